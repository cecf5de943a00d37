#pragma once

#include "controllers/baselines/law.hpp"
#include "controllers/commands_in_flight.hpp"
#include "controllers/estimators/estimator.hpp"
#include "controllers/mpc_controller.hpp"
#include "controllers/posing.hpp"
#include "core/rt/controller.hpp"

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
  explicit LawController(Parts parts) : parts_(std::move(parts)), in_flight_(parts_.modes) {}

  Decision step(const Sensors& sensors) noexcept override {
    tick_ += in_flight_.catch_up(sensors, parts_.estimator);
    Decision d;
    d.reference = parts_.reference.at(sensors.time_s);
    take_estimate(sensors, parts_.use_estimate, parts_.estimator, parts_.model, parts_.motor, d);
    d.command.motor_force_n =
        std::visit([&](const auto& law) { return law.force(d.reference, d.estimate); }, parts_.motor);
    d.command.coils = parts_.law.coils(
        {tick_, sensors.time_s, parts_.reference, d.reference, d.estimate, d.command.motor_force_n, parts_.model});
    in_flight_.take(d.command, parts_.estimator);
    ++tick_;
    return d;
  }

  void applied(const Command& command) noexcept override { in_flight_.correct(command, parts_.estimator); }

  void restart(double time_s, double position_m) noexcept override {
    parts_.reference.restart(time_s, position_m);
    parts_.law.restart();
  }

 private:
  Parts parts_;
  CommandsInFlight in_flight_;
  std::int64_t tick_ = 0;
};

}  // namespace solenoid
