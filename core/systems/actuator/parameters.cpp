#include "core/systems/actuator/parameters.hpp"

#include "core/config/reader.hpp"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// A plain number of the parameter table: key, field, allowed range.
struct Field {
  const char* key;
  double ActuatorParameters::*value;
  Range range;
};

const std::vector<Field>& fields() {
  using P = ActuatorParameters;
  static const std::vector<Field> all = {
      {"bore_diameter_m", &P::bore_diameter_m, Range::positive()},
      {"rod_diameter_m", &P::rod_diameter_m, Range::non_negative()},
      {"dead_length_a_m", &P::dead_length_a_m, Range::positive()},
      {"dead_length_b_m", &P::dead_length_b_m, Range::positive()},
      {"end_clearance_m", &P::end_clearance_m, Range::positive()},
      {"block_mass_kg", &P::block_mass_kg, Range::positive()},
      {"arm_mass_kg", &P::arm_mass_kg, Range::non_negative()},
      {"arm_length_m", &P::arm_length_m, Range::positive()},
      {"gear_pitch_diameter_m", &P::gear_pitch_diameter_m, Range::positive()},
      {"pinion_pitch_diameter_m", &P::pinion_pitch_diameter_m, Range::positive()},
      {"motor_torque_constant", &P::motor_torque_constant, Range::non_negative()},
      {"amplifier_gain", &P::amplifier_gain, Range::non_negative()},
      {"amplifier_limit_v", &P::amplifier_limit_v, Range::non_negative()},
      {"payload_mass_kg", &P::payload_mass_kg, Range::non_negative()},
      {"gravity", &P::gravity, Range::non_negative()},
      {"static_friction_n", &P::static_friction_n, Range::non_negative()},
      {"coulomb_friction_n", &P::coulomb_friction_n, Range::non_negative()},
      {"viscous_friction", &P::viscous_friction, Range::non_negative()},
      {"atmospheric_pressure_pa", &P::atmospheric_pressure_pa, Range::positive()},
      {"supply_pressure_pa", &P::supply_pressure_pa, Range::positive()},
      {"heat_capacity_ratio", &P::heat_capacity_ratio, Range::between(1.0, 2.0)},
      {"gas_constant", &P::gas_constant, Range::positive()},
      {"temperature_k", &P::temperature_k, Range::positive()},
      {"fill_coefficient", &P::fill_coefficient, Range::non_negative()},
      {"discharge_coefficient", &P::discharge_coefficient, Range::non_negative()},
      {"choked_flow", &P::choked_flow, Range::non_negative()},
      {"critical_pressure_ratio", &P::critical_pressure_ratio, {0.0, 1.0, true}},
      {"energise_delay_s", &P::energise_delay_s, Range::between(0.0, 0.05)},
      {"deenergise_delay_s", &P::deenergise_delay_s, Range::between(0.0, 0.05)},
  };
  return all;
}

}  // namespace

double ActuatorParameters::equivalent_mass_kg() const {
  const double r = gear_radius_m();
  const double unloaded = inferred_equivalent_mass_kg.value_or(block_mass_kg + arm_inertia() / (r * r));
  return unloaded + payload_inertia() / (r * r);
}

double ActuatorParameters::gravity_torque_nm() const {
  const double arm = inferred_arm_torque_nm.value_or(arm_mass_kg / 2 * arm_length_m * gravity);
  return arm + payload_mass_kg * arm_length_m * gravity;
}

double ActuatorParameters::gravity_force_n(double position_m) const {
  if (plane == Plane::horizontal) return 0.0;
  return block_mass_kg * gravity - gravity_torque_nm() * std::sin(position_m / gear_radius_m()) / gear_radius_m();
}

double ActuatorParameters::equilibrium_position_m() const {
  const double sine = block_mass_kg * gravity * gear_radius_m() / gravity_torque_nm();
  if (!(std::abs(sine) <= 1.0))
    throw ConfigError(
        fmt::format("no equilibrium: the arm and its payload of {} kg carry {:.3g} N of the slide's {:.3g} N "
                    "(allowed: payload_kg, block_mass_kg and arm_mass_kg with a hanging equilibrium)",
                    payload_mass_kg, gravity_torque_nm() / gear_radius_m(), block_mass_kg * gravity));
  return std::asin(sine) * gear_radius_m();
}

void ActuatorParameters::validate(const std::string& where) const {
  const auto refuse = [&](const char* key, const std::string& problem) {
    throw ConfigError(fmt::format("{}: key '{}': {}", where, key, problem));
  };
  for (const Field& field : fields())
    if (const double value = this->*field.value; !std::isfinite(value) || !field.range.contains(value))
      refuse(field.key, fmt::format("{} is refused (allowed: {})", value, field.range.text()));
  if (const std::string problem = servo_valve_problem(servo); !problem.empty())
    throw ConfigError(fmt::format("{}: table 'servo': {}", where, problem));
  if (!(rod_diameter_m < bore_diameter_m))
    refuse("rod_diameter_m", "the rod fills the bore (allowed: less than bore_diameter_m)");
  if (!(position_min_m() < position_max_m()))
    refuse("end_clearance_m", "leaves no stroke (allowed: less than half of it)");
  if (!(supply_pressure_pa > atmospheric_pressure_pa))
    refuse("supply_pressure_pa", "absolute pressure expected (allowed: above atmospheric_pressure_pa)");
  if (!(equivalent_mass_kg() > 0)) refuse("inferred_equivalent_mass_kg", "not positive (allowed: a number > 0)");
  // The stroke must stay where the arm-angle polynomial is exact to rounding (dynamics.hpp).
  const double from = position_min_m() / gear_radius_m(), to = position_max_m() / gear_radius_m();
  if (std::abs(from - std::numbers::pi / 2) > 1.8 || std::abs(to - std::numbers::pi / 2) > 1.8)
    refuse("gear_pitch_diameter_m",
           fmt::format("the stroke turns the arm from {:.2f} to {:.2f} rad (allowed: within -0.22 "
                       "to 3.37 rad)",
                       from, to));
}

const std::vector<std::string>& parameter_set_names() {
  static const std::vector<std::string> names = {"consistent", "printed", "inferred", "printed+inferred",
                                                 "consistent+no_rod_atmosphere"};
  return names;
}

std::string named_parameters_help() {
  return "consistent | printed | inferred, each optionally +inferred, +no_rod_atmosphere";
}

ActuatorParameters named_parameters(const std::string& name) {
  ActuatorParameters p;
  std::istringstream parts(name);
  std::string part;
  bool first = true;
  while (std::getline(parts, part, '+')) {
    if (part == "inferred") {
      p.inferred_equivalent_mass_kg = 17.6;
      p.inferred_arm_torque_nm = 0.774;
    } else if (first && part == "printed") {
      p.choked_flow = 0.0061;
    } else if (!first && part == "no_rod_atmosphere") {
      p.rod_atmosphere = false;
    } else if (!first || part != "consistent") {
      throw std::invalid_argument(
          fmt::format("parameter set '{}' is not known (allowed: {})", name, named_parameters_help()));
    }
    first = false;
  }
  if (first) throw std::invalid_argument(fmt::format("an empty parameter set (allowed: {})", named_parameters_help()));
  return p;
}

ActuatorParameters read_parameters(TableReader& table) {
  ActuatorParameters p;
  const std::string base = table.text_or("base", "consistent");
  try {
    p = named_parameters(base);
  } catch (const std::invalid_argument& error) {
    table.fail("base", error.what());
  }
  for (const Field& field : fields()) p.*field.value = table.number_or(field.key, p.*field.value, field.range);
  if (table.has("servo")) {
    TableReader servo = table.table("servo");
    read_servo_valve(servo, p.servo);
  }
  p.rod_atmosphere = table.boolean_or("rod_atmosphere", p.rod_atmosphere);
  if (table.has("inferred_equivalent_mass_kg"))
    p.inferred_equivalent_mass_kg = table.number("inferred_equivalent_mass_kg", Range::positive());
  if (table.has("inferred_arm_torque_nm"))
    p.inferred_arm_torque_nm = table.number("inferred_arm_torque_nm", Range::non_negative());
  p.plane = table.text_or("plane", "vertical", {"vertical", "horizontal"}) == "vertical" ? Plane::vertical
                                                                                         : Plane::horizontal;
  table.finish();
  p.validate(table.where());
  return p;
}

ActuatorParameters Mismatch::applied_to(ActuatorParameters p) const {
  p.static_friction_n *= friction;
  p.coulomb_friction_n *= friction;
  p.viscous_friction *= friction;
  p.fill_coefficient *= flow;
  p.discharge_coefficient *= flow;
  p.choked_flow *= flow;
  p.supply_pressure_pa = p.atmospheric_pressure_pa + supply * (p.supply_pressure_pa - p.atmospheric_pressure_pa);
  p.energise_delay_s *= delay;
  p.deenergise_delay_s *= delay;
  p.servo.frequency_hz = delay > 0.0 ? p.servo.frequency_hz / delay : 0.0;
  if (inertia != 1.0) {
    const double r = p.gear_radius_m();
    p.inferred_equivalent_mass_kg = inertia * p.equivalent_mass_kg() - p.payload_inertia() / (r * r);
  }
  return p;
}

Mismatch read_mismatch(TableReader& table) {
  Mismatch m;
  m.friction = table.number_or("friction", 1.0, Range::between(0.0, 10.0));
  m.flow = table.number_or("flow", 1.0, {0.0, 10.0, true});
  m.supply = table.number_or("supply", 1.0, {0.0, 5.0, true});
  m.delay = table.number_or("delay", 1.0, Range::between(0.0, 5.0));
  m.inertia = table.number_or("inertia", 1.0, {0.0, 10.0, true});
  table.finish();
  return m;
}

}  // namespace solenoid
