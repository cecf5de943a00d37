#include "core/actuator/dynamics.hpp"

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
      gravity_amplitude_(p.plane == Plane::vertical ? p.gravity_torque_nm() / p.gear_radius_m() : 0.0),
      angle_per_m_(1.0 / p.gear_radius_m()),
      inverse_mass_(1.0 / p.equivalent_mass_kg()),
      static_(p.static_friction_n),
      coulomb_(p.coulomb_friction_n),
      viscous_(p.viscous_friction),
      motor_limit_(p.motor_force_limit_n()),
      critical_ratio_(p.critical_pressure_ratio),
      choked_per_supply_(p.choked_flow / p.supply_pressure_pa) {}

Vector<double, 4> PneumaticActuator::nearest_valid(const Vector<double, 4>& x) const {
  return {std::clamp(x[position], position_min_, position_max_), x[velocity],
          std::clamp(x[pressure_a], 0.0, 2 * supply_), std::clamp(x[pressure_b], 0.0, 2 * supply_)};
}

}  // namespace solenoid
