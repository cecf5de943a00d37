#pragma once

#include "controllers/controller_shell.hpp"
#include "controllers/systems/actuator/laws/law.hpp"
#include "controllers/systems/actuator/motor_inputs.hpp"
#include "core/systems/actuator/signals.hpp"

namespace solenoid {

/// A valve law beside a motor law. A Decider of ControllerShell: the same estimators, references and exits as
/// predictive control.
///
///     each T_s    motor force; the coils of the law, or its whole command
///
/// Law: SwitchPattern coils(const LawInput&) noexcept, of one for valves that switch,
///      or Command command(const LawInput&) noexcept, of one that gives continuous inputs too;
///      void restart() noexcept.
template <class Law>
class LawController {
 public:
  LawController(const PneumaticActuator& model, MotorInputs motor, Law law)
      : model_(model), motor_(std::move(motor)), law_(std::move(law)) {}

  void believe(const EstimateDetail& found) noexcept { motor_.believe(found, model_); }

  void decide(const Moment& now, Decision& d) noexcept {
    const ActuatorState x = actuator_state(d.estimate);
    const double motor_n = motor_.force(d.reference, x);
    const LawInput in{now.tick, now.time_s, now.reference, d.reference.axis[0], x, motor_n, model_};
    if constexpr (requires { law_.command(in); })
      d.command = law_.command(in);
    else
      d.command = actuator_command(law_.coils(in), motor_n);
  }
  void look_ahead(const Moment&, const Decision&, SwitchPattern) noexcept {}
  void restart(std::int64_t) noexcept { law_.restart(); }

 private:
  PneumaticActuator model_;
  MotorInputs motor_;
  Law law_;
};

}  // namespace solenoid
