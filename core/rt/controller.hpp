#pragma once

#include "core/mpc/plan.hpp"
#include "core/reference/trajectory.hpp"
#include "core/rt/io.hpp"
#include "core/safety/faults.hpp"

#include <string_view>

namespace solenoid {

/// An estimator says here what it believes beyond the state, and how well it believes to know it (standard deviations).
/// Zeros, and ones for the factors, stand where it does not say.
struct EstimateDetail {
  double payload_kg = 0.0, payload_sigma_kg = 0.0;
  double disturbance_n = 0.0, disturbance_sigma_n = 0.0;  ///< external force on the slide
  double flow_factor = 1.0, friction_factor = 1.0;
  ActuatorState sigma{};
  double innovation = 0.0;  ///< normalised innovation squared of the tick, chi-square with 3 degrees of freedom
};

/// A rung of the degradation ladder is what stands behind a command, from best to worst (docs/reference/realtime.md).
enum class Rung : std::uint8_t {
  fresh,    ///< the plan made for this slot
  shifted,  ///< an older plan, at its own later blocks
  dmpc,     ///< four candidates held over the horizon, searched in the tick itself
  motor,    ///< the motor's position law alone, the coils off
  safe,     ///< latched: coils off, motor 0 N, after a bounded lowering stage if there is one
};
/// How many rungs there are.
inline constexpr int rungs = 5;

/// The rung as logs spell it.
constexpr std::string_view to_string(Rung rung) {
  constexpr std::string_view names[] = {"fresh", "shifted", "dmpc", "motor", "safe"};
  return names[static_cast<std::size_t>(rung)];
}

/// A decision is what a controller commands in a tick, with what it believed and planned.
struct Decision {
  Command command;
  ActuatorState estimate{};
  EstimateDetail detail;
  ReferenceSample reference;
  double offset_m = 0.0;     ///< integral offset added to the valves' reference
  bool solved = false;       ///< whether `report` belongs to this tick
  std::int64_t ticket = -1;  ///< of a plan that arrived in this tick: the tick its problem was posed in
  SolveReport report;
  Rung rung = Rung::fresh;
  bool planned = true;   ///< whether any plan stands behind the coils
  int plan_age = 0;      ///< ticks since the plan's first block began
  FaultSet faults;       ///< seen in this tick
  FaultSet safe_causes;  ///< what latched SAFE
};

/// A controller turns sensors into a command once a tick. step, applied, restart: no allocation, lock or exception.
class Controller {
 public:
  virtual ~Controller() = default;
  /// Decides what to command in this tick. It is called once a tick; ticks that were missed show in sensors.time_s.
  virtual Decision step(const Sensors& sensors) noexcept = 0;
  /// Tells which command left through the exit in the tick just stepped; a controller that is not told takes its own.
  virtual void applied(const Command& /*command*/) noexcept {}
  /// Begins the task anew at `time_s` from this position, without a jump of the reference.
  virtual void restart(double /*time_s*/, double /*position_m*/) noexcept {}
};

}  // namespace solenoid
