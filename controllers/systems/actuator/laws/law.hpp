#pragma once

#include "core/mpc/mode_set.hpp"
#include "core/reference/restartable.hpp"
#include "core/systems/actuator/dynamics.hpp"

#include <array>
#include <optional>

namespace solenoid {

/// What a valve law sees in a tick: a law decides on the coils from the present alone, without a prediction.
struct LawInput {
  std::int64_t tick = 0;  ///< since the start, skipped ones counted
  double time_s = 0.0;
  const RestartableReference& reference;
  MotionSample desired;  ///< of this tick
  ActuatorState state;   ///< estimated
  double motor_force_n = 0.0;
  const PneumaticActuator& model;  ///< nominal, with the estimated load if the variant uses it
};

/// What a valve does with its chamber.
enum class ChamberAction : std::uint8_t { closed, fill, exhaust };

/// Patterns by what they do with the two chambers, whatever the coils of the configuration are.
class ChamberPatterns {
 public:
  explicit ChamberPatterns(const ModeSet& modes) {
    for (const Mode& mode : modes.modes()) {
      const auto opening = modes.point(mode.pattern);
      at(action(opening[fill_a], opening[exhaust_a]), action(opening[fill_b], opening[exhaust_b])) = mode.pattern;
    }
  }
  /// None where the configuration has no such mode.
  std::optional<SwitchPattern> find(ChamberAction a, ChamberAction b) const { return patterns_[index(a, b)]; }
  /// For modes that the configuration is known to have.
  SwitchPattern operator()(ChamberAction a, ChamberAction b) const noexcept {
    return patterns_[index(a, b)].value_or(0);
  }

 private:
  static ChamberAction action(double fill, double exhaust) {
    return fill > 0 ? ChamberAction::fill : exhaust > 0 ? ChamberAction::exhaust : ChamberAction::closed;
  }
  static std::size_t index(ChamberAction a, ChamberAction b) {
    return 3 * static_cast<std::size_t>(a) + static_cast<std::size_t>(b);
  }
  std::optional<SwitchPattern>& at(ChamberAction a, ChamberAction b) { return patterns_[index(a, b)]; }

  std::array<std::optional<SwitchPattern>, 9> patterns_{};
};

/// Acceleration of the slide [m/s2] under the nominal forces of cylinder, load, motor and friction, from one model
/// step with every valve closed: what pressure sensors give in place of a second difference of the position.
inline double believed_acceleration(const PneumaticActuator& model, const ActuatorState& x, double motor_n) noexcept {
  constexpr double dt = 1e-3;
  return (model.step<double>(x, {0, 0, 0, 0}, {motor_n}, dt)[velocity] - x[velocity]) / dt;
}

}  // namespace solenoid
