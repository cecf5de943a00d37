#pragma once

#include "core/reference/motion.hpp"
#include "core/systems/actuator/prestabilised.hpp"

#include <variant>

namespace solenoid {

/// PD law (5.14): F = K_pe (y_d - y) + K_de (v_d - v), saturated.
class PdMotor {
 public:
  PdMotor(const PneumaticActuator& model, const MotorGains& gains) : model_(model), gains_(gains) {}
  double force(const MotionSample& desired, const ActuatorState& x) const {
    return model_.saturated_motor_force(gains_.proportional * (desired.value - x[position]) +
                                        gains_.derivative * (desired.rate - x[velocity]));
  }

 private:
  PneumaticActuator model_;
  MotorGains gains_;
};

/// Inverse dynamics (5.12): the PD law plus m_eq a_d - F_cyl - F_grav + F_fric of the nominal model, saturated.
/// Friction is F_cf sign(v) + C_vf v, none at rest. A load that an estimator found enters mass and gravity (payload)
/// and is subtracted (external force).
class InverseDynamicsMotor {
 public:
  InverseDynamicsMotor(const PneumaticActuator& model, const MotorGains& gains) : model_(model), gains_(gains) {}
  void set_load(double payload_kg, double external_force_n) noexcept {
    model_.set_load(payload_kg, external_force_n);
    external_n_ = external_force_n;
  }
  double force(const MotionSample& desired, const ActuatorState& x) const {
    const ActuatorParameters& p = model_.parameters();
    const double v = x[velocity];
    const double friction = p.coulomb_friction_n * ((v > 0) - (v < 0)) + p.viscous_friction * v;
    return model_.saturated_motor_force(
        p.equivalent_mass_kg() * desired.acceleration + gains_.proportional * (desired.value - x[position]) +
        gains_.derivative * (desired.rate - x[velocity]) - model_.cylinder_force(x[pressure_a], x[pressure_b]) -
        model_.gravity_force(x[position]) - external_n_ + friction);
  }

 private:
  PneumaticActuator model_;
  MotorGains gains_;
  double external_n_ = 0.0;
};

/// No motor: the cylinder alone.
struct NoMotor {
  double force(const MotionSample&, const ActuatorState&) const { return 0.0; }
};

/// Any of them, chosen when a variant is read.
using MotorLaw = std::variant<NoMotor, PdMotor, InverseDynamicsMotor>;

/// The motor's force by its law alone.
inline double law_force(const MotorLaw& motor, const ReferenceSample& desired, const ActuatorState& x) noexcept {
  return std::visit([&](const auto& law) { return law.force(desired.axis[0], x); }, motor);
}

}  // namespace solenoid
