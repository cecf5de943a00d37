#include "experiments/systems/actuator/twin/twin_physics.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {

TwinPhysics::TwinPhysics(const TwinParameters& p)
    : parameters_(p),
      model_(p.actuator),
      orifices_(fitted_orifices(model_, p.flow.critical_ratio, p.flow.laminar_from)),
      area_a_(p.actuator.piston_area_a()),
      area_b_(p.actuator.piston_area_b()),
      mass_kg_(p.actuator.equivalent_mass_kg()),
      rotor_mass_kg_(4 * p.gear.rotor_inertia /
                     (p.actuator.pinion_pitch_diameter_m * p.actuator.pinion_pitch_diameter_m)),
      bristle_damping_(2 * p.friction.bristle_damping * std::sqrt(p.friction.bristle_stiffness * mass_kg_)),
      lugre_(p.friction.law == FrictionLaw::lugre && p.actuator.coulomb_friction_n > 0),
      iso_(p.flow.law == FlowLaw::iso6358),
      heat_(p.thermal.law == ThermalLaw::heat_transfer),
      polytropic_(p.thermal.law == ThermalLaw::polytropic),
      reservoir_(p.supply.reservoir),
      backlash_(p.gear.backlash),
      lagged_(p.motor_lag_s > 0) {}

void TwinPhysics::set_supply(double pressure_pa) noexcept {
  parameters_.actuator.supply_pressure_pa = pressure_pa;
  model_ = PneumaticActuator(parameters_.actuator);
}

TwinPhysics::ChamberFlow TwinPhysics::chamber_flow(double pressure, double temperature_k, double supply,
                                                   double fill_opening, double exhaust_opening) const {
  const ActuatorParameters& a = parameters_.actuator;
  if (iso_)
    return {
        fill_opening * orifices_.fill.flow(supply, a.temperature_k, pressure, temperature_k),
        -exhaust_opening * orifices_.exhaust.flow(pressure, temperature_k, a.atmospheric_pressure_pa, a.temperature_k)};
  const double fill = reservoir_ ? model_.fill_flow<double>(pressure, supply) : model_.fill_flow<double>(pressure);
  return {fill_opening * fill, exhaust_opening * model_.exhaust_flow<double>(pressure)};
}

double TwinPhysics::pressure_rate(double pressure, double temperature_k, double length_m, double length_rate,
                                  double area_m2, const ChamberFlow& flow) const {
  const ActuatorParameters& a = parameters_.actuator;
  const ThermalEffects& h = parameters_.thermal;
  const double k = a.heat_capacity_ratio;
  const double alpha_in = polytropic_ ? h.alpha_in : k, alpha_out = polytropic_ ? h.alpha_out : k;
  // Air brings the temperature of where it comes from.
  const auto carried = [&](double mdot) {
    return mdot > 0 ? alpha_in * a.temperature_k * mdot : alpha_out * temperature_k * mdot;
  };
  double power = a.gas_constant * (carried(flow.fill) + carried(flow.exhaust)) -
                 (polytropic_ ? h.exponent : k) * pressure * area_m2 * length_rate;
  if (heat_) {
    const double wall = 2 * area_m2 + std::numbers::pi * a.bore_diameter_m * length_m;
    power += (k - 1) * h.heat_transfer * wall * (a.temperature_k - temperature_k);
  }
  return power / (area_m2 * length_m);
}

double TwinPhysics::temperature(double pressure, double length_m, double area_m2, double mass_kg) const {
  return pressure * area_m2 * length_m / (mass_kg * parameters_.actuator.gas_constant);
}

void TwinPhysics::air_rates(const TwinState& x, const Openings& opening, TwinState& dx) const {
  const ActuatorParameters& a = parameters_.actuator;
  const double v = dx[position];
  const double length_a = model_.column_a<double>(x[position]), length_b = model_.column_b<double>(x[position]);
  const double t_a = heat_ ? temperature(x[pressure_a], length_a, area_a_, x[twin_mass_a]) : a.temperature_k;
  const double t_b = heat_ ? temperature(x[pressure_b], length_b, area_b_, x[twin_mass_b]) : a.temperature_k;
  const ChamberFlow flow_a =
      chamber_flow(x[pressure_a], t_a, x[twin_supply], opening[fill_a], opening[exhaust_a] + leak_[0]);
  const ChamberFlow flow_b =
      chamber_flow(x[pressure_b], t_b, x[twin_supply], opening[fill_b], opening[exhaust_b] + leak_[1]);
  dx[pressure_a] = pressure_rate(x[pressure_a], t_a, length_a, v, area_a_, flow_a);
  dx[pressure_b] = pressure_rate(x[pressure_b], t_b, length_b, -v, area_b_, flow_b);
  dx[twin_mass_a] = flow_a.fill + flow_a.exhaust;
  dx[twin_mass_b] = flow_b.fill + flow_b.exhaust;
  dx[twin_drawn] = flow_a.fill + flow_b.fill;
  dx[twin_vented] = -flow_a.exhaust - flow_b.exhaust;
  if (!reservoir_) return;
  const SupplyEffects& s = parameters_.supply;
  const double fed = std::clamp(s.conductance * (a.supply_pressure_pa - x[twin_supply]), 0.0, s.largest_flow);
  dx[twin_supply] = a.gas_constant * a.temperature_k * (fed - dx[twin_drawn]) / s.volume_m3;
}

double TwinPhysics::contact_force(const TwinState& x) const {
  const GearEffects& g = parameters_.gear;
  const double gap = x[twin_rotor_y] - x[position], closing = x[twin_rotor_v] - x[velocity];
  const double depth = std::abs(gap) - g.backlash_m / 2;
  if (depth <= 0) return 0.0;
  const double direction = gap > 0 ? 1.0 : -1.0;
  return direction * std::max(0.0, g.stiffness * depth * (1 + g.damping * direction * closing));
}

double TwinPhysics::applied_force(const TwinState& x, double motor_command_n) const {
  const double direct = lagged_ ? x[twin_motor] : model_.saturated_motor_force(motor_command_n);
  return model_.cylinder_force(x[pressure_a], x[pressure_b]) + model_.gravity_force(x[position]) +
         (backlash_ ? contact_force(x) : direct);
}

double TwinPhysics::stribeck(double v) const {
  const double r = v / parameters_.friction.stribeck_velocity;
  return r * r > 40 ? 0.0 : std::exp(-r * r);
}

double TwinPhysics::bristle_rate(double z, double v) const {
  const ActuatorParameters& a = parameters_.actuator;
  const double level = a.coulomb_friction_n + (a.static_friction_n - a.coulomb_friction_n) * stribeck(v);
  return v - parameters_.friction.bristle_stiffness * std::abs(v) * z / level;
}

double TwinPhysics::bristle_after(double z, double v, double dt) const {
  const ActuatorParameters& a = parameters_.actuator;
  if (v == 0.0) return z;
  const double level = a.coulomb_friction_n + (a.static_friction_n - a.coulomb_friction_n) * stribeck(v);
  const double rate = parameters_.friction.bristle_stiffness * std::abs(v) / level;
  const double settled = v / rate;
  return settled + (z - settled) * std::exp(-rate * dt);
}

double TwinPhysics::friction(const TwinState& x, SlideMotion motion, double bristle_rate) const {
  const double v = x[velocity];
  if (!lugre_) return model_.sliding_friction<double>(v, motion == SlideMotion::up ? 1.0 : -1.0);
  // The model's sliding law less its Coulomb level is the viscous share.
  return parameters_.friction.bristle_stiffness * x[twin_bristle] + bristle_damping_ * stribeck(v) * bristle_rate +
         model_.sliding_friction<double>(v, 0.0);
}

double TwinPhysics::friction_at_rest(const TwinState& x) const {
  return lugre_ ? parameters_.friction.bristle_stiffness * x[twin_bristle] : 0.0;
}

void TwinPhysics::slide_rates(const TwinState& x, double motor_command_n, SlideMotion motion, TwinState& dx) const {
  if (motion == SlideMotion::held) {
    dx[position] = dx[velocity] = 0.0;
    return;
  }
  const double bristle = lugre_ ? bristle_rate(x[twin_bristle], x[velocity]) : 0.0;
  dx[position] = x[velocity];
  dx[velocity] = (applied_force(x, motor_command_n) - friction(x, motion, bristle)) / mass_kg_;
  dx[twin_bristle] = bristle;
}

void TwinPhysics::motor_rates(const TwinState& x, double motor_command_n, TwinState& dx) const {
  const double wanted = model_.saturated_motor_force(motor_command_n);
  if (lagged_) dx[twin_motor] = (wanted - x[twin_motor]) / parameters_.motor_lag_s;
  if (!backlash_) return;
  dx[twin_rotor_y] = x[twin_rotor_v];
  dx[twin_rotor_v] = ((lagged_ ? x[twin_motor] : wanted) - contact_force(x)) / rotor_mass_kg_;
}

TwinState TwinPhysics::rates(const TwinState& x, const Openings& opening, double motor_command_n,
                             SlideMotion motion) const {
  TwinState dx{};
  slide_rates(x, motor_command_n, motion, dx);
  air_rates(x, opening, dx);
  motor_rates(x, motor_command_n, dx);
  return dx;
}

TwinState TwinPhysics::rates_at_fixed_bristle(const TwinState& x, const Openings& opening, double motor_command_n,
                                              SlideMotion motion) const {
  TwinState dx = rates(x, opening, motor_command_n, motion);
  dx[twin_bristle] = 0.0;
  return dx;
}

SlideMotion TwinPhysics::motion_from(const TwinState& x, double motor_command_n) const {
  const double v = x[velocity];
  const bool low = x[position] <= position_min(), high = x[position] >= position_max();
  const double applied = applied_force(x, motor_command_n), net = applied - friction_at_rest(x);
  if (v == 0.0 && ((low && net <= 0) || (high && net >= 0))) return SlideMotion::held;
  if (lugre_) return SlideMotion::smooth;
  if (v != 0.0) return v > 0 ? SlideMotion::up : SlideMotion::down;
  if (std::abs(applied) <= static_friction()) return SlideMotion::held;
  return applied > 0 ? SlideMotion::up : SlideMotion::down;
}

TwinState TwinPhysics::state_at_rest(double y) const {
  const ActuatorParameters& a = parameters_.actuator;
  TwinState x{};
  x[position] = x[twin_rotor_y] = y;
  x[pressure_a] = x[pressure_b] = a.atmospheric_pressure_pa;
  x[twin_supply] = a.supply_pressure_pa;
  const double per_kelvin = a.atmospheric_pressure_pa / (a.gas_constant * a.temperature_k);
  x[twin_mass_a] = per_kelvin * area_a_ * model_.column_a<double>(y);
  x[twin_mass_b] = per_kelvin * area_b_ * model_.column_b<double>(y);
  // The bristles carry what gravity leaves, as far as they can.
  if (lugre_) {
    const double carried = std::clamp(applied_force(x, 0.0), -a.static_friction_n, a.static_friction_n);
    x[twin_bristle] = carried / parameters_.friction.bristle_stiffness;
  }
  return x;
}

}  // namespace solenoid
