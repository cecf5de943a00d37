#include "experiments/systems/actuator/twin/twin_parameters.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/embedded.hpp"

#include <functional>

#include <fmt/format.h>

namespace solenoid {
namespace {

void section(TableReader& table, const char* key, const std::function<void(TableReader&)>& read) {
  if (!table.has(key)) return;
  TableReader inner = table.table(key);
  read(inner);
  inner.finish();
}

void read_valves(TableReader& t, TwinParameters& p) {
  ValveTravel& v = p.valves;
  v.rise_s = t.number_or("travel_rise_s", v.rise_s, Range::between(0.0, 0.05));
  v.fall_s = t.number_or("travel_fall_s", v.fall_s, Range::between(0.0, 0.05));
  v.jitter_sigma_s = t.number_or("jitter_sigma_s", v.jitter_sigma_s, Range::between(0.0, 0.005));
  if (v.rise_s / 2 > p.actuator.energise_delay_s)
    t.fail("travel_rise_s", "takes the valve past half before its delay (allowed: twice energise_delay_s at most)");
  if (v.fall_s / 2 > p.actuator.deenergise_delay_s)
    t.fail("travel_fall_s", "takes the valve past half before its delay (allowed: twice deenergise_delay_s at most)");
}

void read_flow(TableReader& t, FlowEffects& f) {
  f.law = t.text_or("law", "model", {"model", "iso6358"}) == "model" ? FlowLaw::model : FlowLaw::iso6358;
  f.critical_ratio = t.number_or("critical_ratio", f.critical_ratio, Range::between(0.0, 0.9));
  f.laminar_from = t.number_or("laminar_from", f.laminar_from, Range::between(0.3, 0.9999));
  if (f.laminar_from <= f.critical_ratio)
    t.fail("laminar_from", "not above critical_ratio (allowed: laminar flow begins after choked flow ends)");
}

void read_thermal(TableReader& t, ThermalEffects& h) {
  const std::string law = t.text_or("law", "model", {"model", "polytropic", "heat_transfer"});
  h.law = law == "model" ? ThermalLaw::model : law == "polytropic" ? ThermalLaw::polytropic : ThermalLaw::heat_transfer;
  h.alpha_in = t.number_or("alpha_in", h.alpha_in, Range::between(1.0, 2.0));
  h.alpha_out = t.number_or("alpha_out", h.alpha_out, Range::between(1.0, 2.0));
  h.exponent = t.number_or("exponent", h.exponent, Range::between(1.0, 2.0));
  h.heat_transfer = t.number_or("heat_transfer_w_per_m2k", h.heat_transfer, Range::between(0.0, 2e4));
}

/// Fastest relaxation the fixed step of 0.1 ms follows safely [1/s]; Runge-Kutta 4 is stable to 2.8 a step.
constexpr double fastest_rate = 1e4;

void read_supply(TableReader& t, TwinParameters& p) {
  SupplyEffects& s = p.supply;
  s.reservoir = t.text_or("law", "constant", {"constant", "reservoir"}) == "reservoir";
  s.volume_m3 = t.number_or("volume_m3", s.volume_m3, Range::between(1e-5, 10.0));
  s.conductance = t.number_or("regulator_conductance", s.conductance, Range::between(0.0, 1e-4));
  s.largest_flow = t.number_or("regulator_largest_flow", s.largest_flow, Range::non_negative());
  if (s.conductance * p.actuator.gas_constant * p.actuator.temperature_k / s.volume_m3 > fastest_rate)
    t.fail("regulator_conductance", "refills the reservoir within 0.1 ms (allowed: less, or a larger volume_m3)");
}

void read_friction(TableReader& t, TwinParameters& p) {
  FrictionEffects& f = p.friction;
  f.law = t.text_or("law", "model", {"model", "lugre"}) == "model" ? FrictionLaw::model : FrictionLaw::lugre;
  f.bristle_stiffness = t.number_or("bristle_stiffness", f.bristle_stiffness, Range::between(1e2, 1e7));
  f.bristle_damping = t.number_or("bristle_damping", f.bristle_damping, Range::between(0.0, 2.0));
  f.stribeck_velocity = t.number_or("stribeck_velocity", f.stribeck_velocity, Range::between(1e-4, 1.0));
}

void read_gear(TableReader& t, GearEffects& g) {
  g.backlash = t.text_or("law", "rigid", {"rigid", "backlash"}) == "backlash";
  g.backlash_m = t.number_or("backlash_m", g.backlash_m, Range::between(0.0, 0.01));
  g.stiffness = t.number_or("stiffness", g.stiffness, Range::between(1e3, 1e6));
  g.damping = t.number_or("damping", g.damping, Range::between(0.0, 1e3));
  g.rotor_inertia = t.number_or("rotor_inertia", g.rotor_inertia, Range::between(1e-6, 1e-2));
}

void read_motor(TableReader& t, TwinParameters& p) {
  p.motor_lag_s = t.number_or("lag_s", p.motor_lag_s, Range::between(0.0, 0.1));
  if (p.motor_lag_s > 0 && p.motor_lag_s < 1 / fastest_rate)
    t.fail("lag_s",
           fmt::format("{} is shorter than a step (allowed: 0, or {} to 0.1)", p.motor_lag_s, 1 / fastest_rate));
}

void read_sensing(TableReader& t, SensingEffects& s) {
  s.position_sigma_m = t.number_or("position_sigma_m", s.position_sigma_m, Range::non_negative());
  s.position_low_m = t.number_or("position_low_m", s.position_low_m);
  s.position_high_m = t.number_or("position_high_m", s.position_high_m);
  s.pressure_sigma_pa = t.number_or("pressure_sigma_pa", s.pressure_sigma_pa, Range::non_negative());
  s.spike_pa = t.number_or("spike_pa", s.spike_pa, Range::non_negative());
  s.spike_rate_hz = t.number_or("spike_rate_hz", s.spike_rate_hz, Range::between(0.0, 1000.0));
  s.spike_duration_s = t.number_or("spike_duration_s", s.spike_duration_s, Range::between(0.0, 0.1));
  s.bessel_hz = t.number_or("bessel_hz", s.bessel_hz, Range::between(0.0, 2000.0));
  s.pressure_span_pa = t.number_or("pressure_span_pa", s.pressure_span_pa, Range::positive());
  s.converter_bits = t.integer_or("converter_bits", s.converter_bits, 0, 24);
  if (!(s.position_low_m < s.position_high_m))
    t.fail("position_high_m", "not above position_low_m (allowed: a range of positive length)");
}

void read_integration(TableReader& t, IntegrationChoice& i) {
  i.method =
      t.text_or("method", "fixed", {"fixed", "adaptive"}) == "fixed" ? Integration::fixed : Integration::adaptive;
  i.steps = t.integer_or("steps", i.steps, 1, 1000);
  i.tolerance = t.number_or("tolerance", i.tolerance, Range::between(1e-13, 1e-3));
}

/// Below the Coulomb level there is no law for a slide at rest: it would break away only to stop again.
void check_friction(const TableReader& table, const ActuatorParameters& p) {
  if (p.static_friction_n < p.coulomb_friction_n)
    table.fail("actuator", "static_friction_n below coulomb_friction_n (allowed: at least as large)");
}

}  // namespace

TwinParameters read_twin(TableReader& table) {
  TwinParameters p;
  if (table.has("actuator")) {
    TableReader actuator = table.table("actuator");
    p.actuator = read_parameters(actuator);
  }
  check_friction(table, p.actuator);
  section(table, "valves", [&](TableReader& t) { read_valves(t, p); });
  section(table, "flow", [&](TableReader& t) { read_flow(t, p.flow); });
  section(table, "thermal", [&](TableReader& t) { read_thermal(t, p.thermal); });
  section(table, "supply", [&](TableReader& t) { read_supply(t, p); });
  section(table, "friction", [&](TableReader& t) { read_friction(t, p); });
  section(table, "gear", [&](TableReader& t) { read_gear(t, p.gear); });
  section(table, "motor", [&](TableReader& t) { read_motor(t, p); });
  section(table, "sensing", [&](TableReader& t) { read_sensing(t, p.sensing); });
  section(table, "integration", [&](TableReader& t) { read_integration(t, p.integration); });
  table.finish();
  return p;
}

TwinParameters read_twin_file(const std::string& path) {
  TableReader table = TableReader::from_file(path);
  return read_twin(table);
}

const TwinParameters& nominal_twin() {
  static const TwinParameters twin = [] {
    TableReader table =
        TableReader::from_text(std::string(embedded_text("scenarios/twin.toml")), "scenarios/twin.toml");
    return read_twin(table);
  }();
  return twin;
}

}  // namespace solenoid
