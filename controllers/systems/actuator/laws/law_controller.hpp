#pragma once

#include "controllers/controller_shell.hpp"
#include "controllers/systems/actuator/laws/law.hpp"

namespace solenoid {

/// A valve law beside a motor law. A Decider of ControllerShell: the same estimators, references and exits as
/// predictive control.
///
///     each T_s    motor force; the coils of the law
///
/// Law: SwitchPattern coils(const LawInput&) noexcept; void restart() noexcept.
template <class Law>
class LawController {
 public:
  LawController(const PneumaticActuator& model, Law law) : model_(model), law_(std::move(law)) {}

  void believe(double payload_kg, double external_force_n) noexcept { model_.set_load(payload_kg, external_force_n); }
  double payload_kg() const noexcept { return model_.parameters().payload_mass_kg; }

  void decide(const Moment& now, Decision& d) noexcept {
    d.command.motor_force_n = law_force(now.motor, d.reference, d.estimate);
    d.command.coils =
        law_.coils({now.tick, now.time_s, now.reference, d.reference, d.estimate, d.command.motor_force_n, model_});
  }
  void look_ahead(const Moment&, const Decision&, SwitchPattern) noexcept {}
  void restart(std::int64_t) noexcept { law_.restart(); }

 private:
  PneumaticActuator model_;
  Law law_;
};

}  // namespace solenoid
