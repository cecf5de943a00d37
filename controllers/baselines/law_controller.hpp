#pragma once

#include "controllers/baselines/law.hpp"
#include "controllers/estimators/estimator.hpp"
#include "controllers/mpc_controller.hpp"
#include "controllers/posing.hpp"
#include "core/rt/controller.hpp"

#include <cmath>
#include <limits>

namespace solenoid {

/// A valve law beside a motor law, around the same estimators, references and exits as predictive control.
///
///     each T_s    estimate; motor force; the coils of the law
///
/// Law: SwitchPattern coils(const LawInput&) noexcept; void restart() noexcept.
template <class Law>
class LawController final : public Controller {
 public:
  struct Parts {
    PneumaticActuator model;
    ModeSet modes;
    Law law;
    RestartableReference reference;
    MotorLaw motor;
    Estimator estimator;
    UseEstimate use_estimate;
  };
  explicit LawController(Parts parts) : parts_(std::move(parts)), timing_(parts_.modes, tick_s) {}

  Decision step(const Sensors& sensors) noexcept override {
    pass_skipped_ticks(sensors);
    Decision d;
    d.reference = parts_.reference.at(sensors.time_s);
    take_estimate(sensors, parts_.use_estimate, parts_.estimator, parts_.model, parts_.motor, d);
    d.command.motor_force_n =
        std::visit([&](const auto& law) { return law.force(d.reference, d.estimate); }, parts_.motor);
    d.command.coils = parts_.law.coils(
        {tick_, sensors.time_s, parts_.reference, d.reference, d.estimate, d.command.motor_force_n, parts_.model});
    ++tick_;
    go_on(d.command);
    return d;
  }

  void applied(const Command& command) noexcept override {
    if (command == assumed_) return;
    lines_ = before_;
    go_on(command);
  }

  void restart(double time_s, double position_m) noexcept override {
    parts_.reference.restart(time_s, position_m);
    parts_.law.restart();
  }

 private:
  /// The command of a tick acts until the next one.
  void go_on(const Command& command) noexcept {
    before_ = lines_;
    assumed_ = command;
    lines_.command(command.coils, timing_);
    SwitchedOf<PneumaticActuator> opening{};
    std::ranges::copy(parts_.modes.point(lines_.effective()), opening.begin());
    parts_.estimator.applied(opening, command.motor_force_n);
    lines_.advance(1);
  }

  /// They went by under the last command; the estimator predicts through the first of them.
  void pass_skipped_ticks(Sensors sensors) noexcept {
    const auto skipped = tick_ == 0 ? 0 : std::llround((sensors.time_s - last_time_s_) / tick_s) - 1;
    last_time_s_ = sensors.time_s;
    sensors.position_m = sensors.pressure_a_pa = sensors.pressure_b_pa = std::numeric_limits<double>::quiet_NaN();
    for (std::int64_t k = 0; k < skipped; ++k, ++tick_) {
      if (k < most_predicted_ticks && !sensors.ideal) parts_.estimator.update(sensors);
      go_on(assumed_);
    }
  }
  static constexpr std::int64_t most_predicted_ticks = 20;

  Parts parts_;
  SwitchTiming timing_;
  SwitchLines lines_{0}, before_{0};
  Command assumed_;
  double last_time_s_ = 0.0;
  std::int64_t tick_ = 0;
};

}  // namespace solenoid
