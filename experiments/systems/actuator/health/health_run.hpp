#pragma once

#include "controllers/switch_health.hpp"
#include "experiments/campaign/scenario.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

namespace solenoid {

/// A coil that fails, and when.
struct CoilFault {
  std::size_t coil = 0;
  SwitchFault fault;
  double at_s = 0.0;
};

/// A fault has shown itself when the flow that it lets in or keeps out, as the plant's own laws have it at the plant's own state,
/// amounts to `shown_pa` of its chamber's pressure, older flow being forgotten with the time constant `shown_within_s`:
///
///     dq/dt = |k R T/V (flow with the fault - flow without)| - q/shown_within_s,   q = 0 at the onset, shown where q >= shown_pa
///
/// What changes less cannot be told from a plant whose flows are 20 % from the model's: 10 kPa in 50 ms are 6 % of what a valve's full
/// flow does, and 20 % of the smallest's of pulse code.
inline constexpr double shown_pa = 10e3, shown_within_s = 0.05;

/// What became of a run in which a coil failed, or of one in which none did.
struct HealthRun {
  std::optional<double> shown_s;      ///< when the fault had shown itself
  std::optional<double> found_s;      ///< when a coil was first called failed
  std::optional<FailedSwitch> found;  ///< and which
  double before_mm = 0.0,
         after_mm = 0.0;  ///< root mean square error of the true position before the fault, and after it was found
  double until_s = 0.0;   ///< the run ended
};

/// One run of a variant in a scenario on the truth plant, with its controller's exit and a coil that fails; `ends_after_s` behind the
/// moment in which a coil is called failed or at the scenario's end. Throws ConfigError.
HealthRun run_with_fault(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                         const std::optional<CoilFault>& fault, double ends_after_s,
                         const std::function<void(const Measurement&, const Command&, double changed_pa)>& tick = {});

}  // namespace solenoid
