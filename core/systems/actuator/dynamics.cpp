#include "core/systems/actuator/dynamics.hpp"

#include <algorithm>

namespace solenoid {

PneumaticActuator::PneumaticActuator(const ActuatorParameters& p)
    : parameters_(p),
      area_a_(p.piston_area_a()),
      area_b_(p.piston_area_b()),
      atmosphere_(p.atmospheric_pressure_pa),
      atmosphere_force_(p.rod_atmosphere ? p.atmospheric_pressure_pa * (p.piston_area_a() - p.piston_area_b()) : 0.0),
      supply_(p.supply_pressure_pa),
      choked_flow_(p.choked_flow),
      fill_coefficient_(p.fill_coefficient),
      discharge_coefficient_(p.discharge_coefficient),
      fill_choked_below_(p.critical_pressure_ratio * p.supply_pressure_pa),
      exhaust_choked_above_(p.atmospheric_pressure_pa / p.critical_pressure_ratio),
      ratio_(p.heat_capacity_ratio),
      heating_a_(p.heat_capacity_ratio * p.gas_constant * p.temperature_k / p.piston_area_a()),
      heating_b_(p.heat_capacity_ratio * p.gas_constant * p.temperature_k / p.piston_area_b()),
      dead_length_a_(p.dead_length_a_m),
      dead_length_b_(p.dead_length_b_m),
      position_min_(p.position_min_m()),
      position_max_(p.position_max_m()),
      block_weight_(p.plane == Plane::vertical ? p.block_mass_kg * p.gravity : 0.0),
      angle_per_m_(1.0 / p.gear_radius_m()),
      motor_limit_(p.motor_force_limit_n()),
      critical_ratio_(p.critical_pressure_ratio),
      choked_per_supply_(p.choked_flow / p.supply_pressure_pa) {
  const bool vertical = p.plane == Plane::vertical;
  const double radius = p.gear_radius_m();
  own_ = {1.0 / p.equivalent_mass_kg(),
          vertical ? p.gravity_torque_nm() / radius : 0.0,
          0.0,
          p.static_friction_n,
          p.coulomb_friction_n,
          p.viscous_friction};
  mass_per_payload_ = p.arm_length_m * p.arm_length_m / (radius * radius);
  mass_without_payload_ = p.equivalent_mass_kg() - p.payload_mass_kg * mass_per_payload_;
  gravity_per_payload_ = vertical ? p.arm_length_m * p.gravity / radius : 0.0;
  gravity_without_payload_ = own_.gravity_amplitude - p.payload_mass_kg * gravity_per_payload_;
}

void PneumaticActuator::set_load(double payload_kg, double external_force_n) noexcept {
  parameters_.payload_mass_kg = payload_kg;
  own_.inverse_mass = 1.0 / (mass_without_payload_ + mass_per_payload_ * payload_kg);
  own_.gravity_amplitude = gravity_without_payload_ + gravity_per_payload_ * payload_kg;
  own_.external_force = external_force_n;
}

Vector<double, 4> PneumaticActuator::nearest_valid(const Vector<double, 4>& x) const {
  return {std::clamp(x[position], position_min_, position_max_), x[velocity],
          std::clamp(x[pressure_a], 0.0, 2 * supply_), std::clamp(x[pressure_b], 0.0, 2 * supply_)};
}

}  // namespace solenoid
