#pragma once

#include "controllers/commands_in_flight.hpp"
#include "controllers/estimators/estimator.hpp"
#include "controllers/systems/actuator/motor_laws.hpp"
#include "controllers/variant.hpp"
#include "core/reference/restartable.hpp"
#include "core/rt/controller.hpp"

namespace solenoid {

/// What a decider sees of a tick beside the decision so far (reference and estimate).
struct Moment {
  std::int64_t tick = 0;  ///< since the start, skipped ones counted
  double time_s = 0.0;
  const RestartableReference& reference;
  const CommandsInFlight& in_flight;  ///< as the tick begins, without its own command
  const MotorLaw& motor;
};

/// What every controller of the actuator does around its decision, predictive control and valve laws alike:
///
///     skipped ticks caught up -> reference -> estimate -> Decider -> the command taken as what acts on the plant
///
/// and afterwards what the exit made of it (applied), a task begun anew (restart).
///
/// Decider:  decide(const Moment&, Decision&) noexcept          sets d.command, and what else it knows of d
///           look_ahead(const Moment&, const Decision&, SwitchPattern in_effect) noexcept    once the command is given
///           restart(std::int64_t tick) noexcept
///           believe(payload_kg, external_force_n) noexcept     what the estimator found, where the variant uses it
///           payload_kg() noexcept                              of its model as the variant has it
template <class Decider>
class ControllerShell final : public Controller {
 public:
  /// What the shell is made of.
  struct Parts {
    RestartableReference reference;
    Estimator estimator;
    UseEstimate use_estimate;
    MotorLaw motor;
    ModeSet modes;
  };
  ControllerShell(Parts parts, Decider decider)
      : parts_(std::move(parts)), decider_(std::move(decider)), in_flight_(parts_.modes) {}

  Decision step(const Sensors& sensors) noexcept override {
    tick_ += in_flight_.catch_up(sensors, parts_.estimator);
    Decision d;
    d.reference = parts_.reference.at(sensors.time_s);
    take_estimate(sensors, d);
    const Moment moment{tick_, sensors.time_s, parts_.reference, in_flight_, parts_.motor};
    decider_.decide(moment, d);
    const SwitchPattern in_effect = in_flight_.take(d.command, parts_.estimator);
    decider_.look_ahead(moment, d, in_effect);
    ++tick_;
    return d;
  }

  void applied(const Command& command) noexcept override { in_flight_.correct(command, parts_.estimator); }

  void restart(double time_s, double position_m) noexcept override {
    parts_.reference.restart(time_s, position_m);
    decider_.restart(tick_);
  }

 private:
  /// The state into `d`, and what the prediction uses of the rest of the estimate into the models that decide. Under
  /// ideal sensing the true state passes the estimator by.
  void take_estimate(const Sensors& sensors, Decision& d) noexcept {
    if (sensors.ideal) {
      d.estimate = sensors.truth;
      return;
    }
    d.estimate = parts_.estimator.update(sensors);
    d.detail = parts_.estimator.detail();
    const UseEstimate& use = parts_.use_estimate;
    if (!use.payload && !use.disturbance) return;
    const double payload_kg = use.payload ? d.detail.payload_kg : decider_.payload_kg();
    const double external_n = use.disturbance ? d.detail.disturbance_n : 0.0;
    decider_.believe(payload_kg, external_n);
    if (auto* law = std::get_if<InverseDynamicsMotor>(&parts_.motor)) law->set_load(payload_kg, external_n);
  }

  Parts parts_;
  Decider decider_;
  CommandsInFlight in_flight_;
  std::int64_t tick_ = 0;
};

/// The motor's force by its law alone.
inline double law_force(const MotorLaw& motor, const ReferenceSample& desired, const ActuatorState& x) noexcept {
  return std::visit([&](const auto& law) { return law.force(desired, x); }, motor);
}

}  // namespace solenoid
