#pragma once

#include "experiments/systems/actuator/commission/commission.hpp"

namespace solenoid {

/// The steps, each as it fills in its outcome. A guard's BenchStopped passes through them.
void link_step(CommissionState& state, StepOutcome& out);
void sensors_step(CommissionState& state, StepOutcome& out);
void position_step(CommissionState& state, StepOutcome& out);
void motor_step(CommissionState& state, StepOutcome& out);
void coils_step(CommissionState& state, StepOutcome& out);
void leak_step(CommissionState& state, StepOutcome& out);
void supply_step(CommissionState& state, StepOutcome& out);
void delays_step(CommissionState& state, StepOutcome& out);
void end_stops_step(CommissionState& state, StepOutcome& out);
void identify_step(CommissionState& state, StepOutcome& out);
void motion_step(CommissionState& state, StepOutcome& out);

/// Coil patterns by what they should do, of two_way and three_way valves.
struct CoilPatterns {
  explicit CoilPatterns(bool three_way) : three_way(three_way) {}
  bool three_way;
  /// Chamber k (0: A) filled alone, the other as it is when its coils are off.
  SwitchPattern fill(std::size_t k) const { return SwitchPattern{1} << (three_way ? k : 2 * k); }
  SwitchPattern fill_both() const { return fill(0) | fill(1); }
  /// Chamber k let out; of three-way valves every coil off does it.
  SwitchPattern exhaust(std::size_t k) const { return three_way ? 0 : SwitchPattern{2} << (2 * k); }
  SwitchPattern exhaust_both() const { return exhaust(0) | exhaust(1); }
};

/// The motor holding the slide where `centre_m` is, whichever way motor and position are wired: within `limit_n`, and 0
/// as long as nobody knows their loop's sign.
double hold_force_n(const CommissionState& state, const BenchSample& sample, double centre_m, double limit_n = 4.0);

/// Holds with these coils until the position rests within 0.15 mm for 0.1 s, 1.5 s at most.
void let_rest(CommissionState& state, SwitchPattern coils, const BenchGuard& guard = {});

/// Asks the operator to do something and waits for Enter, safe outputs meanwhile. False: nobody is there, or the
/// answer was "s", to leave it out. "q" is as an interrupt; whatever else is typed is asked again.
bool asked_and_done(CommissionState& state, const std::string& what);

/// Whether a pressure reads more than the weather makes of the atmosphere's, or less, outputs safe.
bool holds_pressure(CommissionState& state);

/// Means of the position and the pressures over samples.
struct BenchMean {
  double position_m = 0.0;
  std::array<double, 2> pressure_pa{};
};
BenchMean mean_of(const std::vector<BenchSample>& samples, std::size_t first = 0);

}  // namespace solenoid
