#pragma once

#include "controllers/systems.hpp"
#include "core/safety/plausibility.hpp"
#include "core/systems/actuator/parameters.hpp"
#include "experiments/systems/actuator/commission/bench.hpp"
#include "experiments/systems/actuator/commission/wiring.hpp"

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// A number that a step found, and what it has to be.
struct Measured {
  std::string name;
  double value = 0.0;
  std::string unit;
  std::optional<double> low = {}, high = {};  ///< of the criterion; none: it is told, not judged
  bool good() const { return (!low || value >= *low) && (!high || value <= *high); }
};

/// How a step ended: as it should; a criterion was missed; nobody could do it or an earlier step is missing; stopped
/// half-way, by a guard or the operator.
enum class StepVerdict { passed, failed, skipped, stopped };
const char* to_string(StepVerdict verdict);

/// What became of a step.
struct StepOutcome {
  std::string name;
  StepVerdict verdict = StepVerdict::passed;
  std::vector<Measured> measured;
  std::vector<std::string> findings;  ///< what is wrong, in words
  std::string note;                   ///< why it was skipped or stopped, or what remains to do
  std::string at;                     ///< when, local time
  double seconds = 0.0;               ///< how long it took

  const Measured* find(const std::string& name) const;
};

/// A step as listings show it.
struct StepInfo {
  const char *name, *what, *criterion;
};
/// All of them, in order.
const std::vector<StepInfo>& commission_steps();

/// Who stands beside the rig. Without anybody nothing is asked, and what needs a hand is left out.
struct Operator {
  bool present = false;
  std::function<void(const std::string&)> ask = {};         ///< prints a question
  std::function<std::optional<std::string>()> answer = {};  ///< what was typed since, if a line was; does not wait
};

/// How the first motion went, whoever made it.
struct MotionOutcome {
  bool clean = false;
  double rmse_mm = 0.0, largest_mm = 0.0;
  std::string told;  ///< why it was not clean
};

/// What a commissioning is of.
struct CommissionSettings {
  const VariantConfig* variant = nullptr;                    ///< told of its task; on two_way or three_way valves
  PlausibilitySettings plausibility;                         ///< whose converters' ends are the rig's
  double position_low_m = -0.005, position_high_m = 0.1085;  ///< the rig's limits, which the end stops must lie outside
  Plane plane = Plane::horizontal;
  Operator beside;
  std::function<bool()> interrupted = [] { return false; };
  std::function<std::string()> now = [] { return std::string(); };        ///< for StepOutcome::at
  std::function<MotionOutcome(Plant&)> motion = {};                       ///< none: the step is left out
  std::string identify_command = "./solenoid identify --plant emulator";  ///< what the operator is told
};

/// What steps share.
struct CommissionState {
  Bench& bench;
  const CommissionSettings& settings;
  ActuatorParameters nominal;
  bool three_way = false;
  WiringSeen seen;
  Answer loop;                   ///< sign of the position's answer to the motor; none or 0: no law may use the motor
  bool wiring_is_known = false;  ///< the coils answered, and as they should
};

/// Carries out one step; what the ones before it found is in `state` and `earlier`. Outputs are safe afterwards,
/// whatever happens. Throws BenchInterrupted, and std::invalid_argument for a name that is no step's.
StepOutcome carry_out(const std::string& step, CommissionState& state, const std::vector<StepOutcome>& earlier);

/// A state before the first step. Throws ConfigError for a variant on other valves.
CommissionState new_commission(Bench& bench, const CommissionSettings& settings);
/// The state after steps that were done before, of which nothing but their outcomes is left.
void recall(CommissionState& state, const std::vector<StepOutcome>& earlier);

}  // namespace solenoid
