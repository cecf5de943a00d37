#include "controllers/variant_keys.hpp"

#include "controllers/catalogue.hpp"
#include "controllers/timing.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr double longest_pulse_period_ticks = 200;

VariantKey by_hand(std::string path, std::string fallback, std::string allowed, std::string meaning,
                   std::string group = "") {
  return {std::move(path), std::move(group), {}, {}, "", std::move(meaning), std::move(fallback), std::move(allowed)};
}

// A key's member: where its value lives in the variant.
#define AT(member) +[](VariantConfig& v) -> decltype((v.member)) { return v.member; }

void add_common(std::vector<VariantKey>& keys) {
  keys.push_back(by_hand("summary", "empty", "a text", "one line for `list`"));
  keys.push_back(by_hand("valves", "\"three_way\"", "`list valves`", "the mode set"));
  keys.push_back(by_hand("model", "\"consistent\"", "`list parameters`, a file in .toml, a table",
                         "the parameters that the controller believes"));
  keys.push_back(by_hand("estimator", "\"thesis\"", "`list estimators`", "what makes the state of the sensors"));
  keys.push_back(by_hand("use_estimate", "\"state\"", "state, payload, disturbance, payload_and_disturbance",
                         "what of the estimate the prediction, and a motor law with inverse dynamics, uses"));
  keys.push_back(by_hand("solver", "\"exhaustive\"", "`list solvers`, `list laws`", "what chooses the modes"));
  keys.push_back(
      by_hand("motor", "\"none\"", "none, pd, inverse_dynamics, in_prediction, joint",
              "the motor's law; `in_prediction`: pd, and the prediction knows it; `joint`: a planned force, on "
              "top of that law, or in its place with `sqp` and `ipopt`"));
  keys.push_back({"motor_gains.proportional", "", AT(motor_gains.proportional), Range::non_negative(), "N/m", "K_pe"});
  keys.push_back({"motor_gains.derivative", "", AT(motor_gains.derivative), Range::non_negative(), "N s/m", "K_de"});
}

void add_planning(std::vector<VariantKey>& keys) {
  const Range weight = Range::non_negative();
  keys.push_back({"latency_ticks", "planning", AT(latency_ticks), Range::between(0, ticks_per_period), "ms",
                  "from a measurement to the effect of its plan; the solver starts from the state forecast to then"});
  keys.push_back({"deadline_ms",
                  "planning",
                  AT(deadline_ms),
                  {0.0, 1e6, true},
                  "ms",
                  "budget of one solve; a solve beyond it returns its best plan so far"});
  keys.push_back({"horizon.steps", "planning", AT(horizon.steps), Range::between(1, 1000), "ms", "N_p, model steps"});
  keys.push_back(by_hand("horizon.blocks", "one block", "whole numbers from 1 to 200 that add up to steps / 5",
                         "lengths in control periods of 5 ms; the mode is constant in a block", "planning"));
  keys.push_back({"cost.position", "planning", AT(cost.position), weight, "1/m2",
                  "weight of the squared position error at each step"});
  keys.push_back({"cost.velocity", "planning", AT(cost.velocity), weight, "s2/m2", "of the squared velocity error"});
  keys.push_back({"cost.switching", "planning", AT(cost.switching), weight, "", "of each coil change"});
  keys.push_back({"cost.air", "planning", AT(cost.air), weight, "1/kg", "of the supply air drawn"});
  keys.push_back({"cost.terminal_position", "planning", AT(cost.terminal_position), weight, "1/m2",
                  "of the squared position error at the last step"});
  keys.push_back({"cost.terminal_velocity", "planning", AT(cost.terminal_velocity), weight, "s2/m2",
                  "of the squared velocity error at the last step"});
  keys.push_back({"cost.motor", "planning", AT(cost.motor), weight, "1/N2",
                  "of the squared motor force that a joint plan chooses, at each step"});
  keys.push_back({"cost.terminal_acceleration", "extended_cost", AT(cost.terminal_acceleration), weight, "s4/m2",
                  "of the squared acceleration error at the last step, what the pressures there bring about"});
  keys.push_back({"rounding.improve",
                  "rounding",
                  AT(rounding.improve),
                  {},
                  "",
                  "mode swaps, and for joint plans the motor force re-optimised, after rounding"});
  keys.push_back({"rounding.iterations", "rounding", AT(rounding.iterations), Range::between(0, 10000), "",
                  "of the relaxation before rounding"});
  keys.push_back({"integral.gain", "planning", AT(integral.gain), weight, "",
                  "of the integral offset of the valves' reference, per 1 ms sample; 0.005 in the thesis"});
  keys.push_back({"integral.forgetting", "planning", AT(integral.forgetting), Range::between(0.0, 1.0), "",
                  "factor on the running sum each sample"});
  keys.push_back({"integral.limit_m", "planning", AT(integral.limit_m), Range::positive(), "m", "bound of the offset"});
}

void add_laws(std::vector<VariantKey>& keys) {
  const Range gain = Range::non_negative(), share = Range::between(0.0, 1.0);
  keys.push_back({"pulse_width.proportional", "pulse_width", AT(pulse_width.proportional), gain, "1/m",
                  "gain on the position error; duties are of full scale, -1 to 1"});
  keys.push_back({"pulse_width.integral", "pulse_width", AT(pulse_width.integral), gain, "1/(m s)", "gain"});
  keys.push_back({"pulse_width.derivative", "pulse_width", AT(pulse_width.derivative), gain, "s/m", "gain"});
  keys.push_back({"pulse_width.integral_limit", "pulse_width", AT(pulse_width.integral_limit), share, "",
                  "bound of the integral's share"});
  keys.push_back({"pulse_width.feedforward", "pulse_width", AT(pulse_width.feedforward), gain, "1/m",
                  "gain on the desired position's change over the coming lead_s"});
  keys.push_back({"pulse_width.lead_s", "pulse_width", AT(pulse_width.lead_s), share, "s", "of the feedforward"});
  keys.push_back(
      {"pulse_width.friction", "pulse_width", AT(pulse_width.friction), share, "", "share against Coulomb friction"});
  keys.push_back({"pulse_width.friction_band_m", "pulse_width", AT(pulse_width.friction_band_m), gain, "m",
                  "errors that are left alone at rest"});
  keys.push_back({"pulse_width.bias", "pulse_width", AT(pulse_width.bias), share, "", "duty of both valves at u = 0"});
  keys.push_back({"pulse_width.period_ticks", "pulse_width", AT(pulse_width.period_ticks),
                  Range::between(5, longest_pulse_period_ticks), "ms", "of the pulses and of the law"});
  keys.push_back(
      {"sliding.frequency", "sliding", AT(sliding.frequency), Range::positive(), "rad/s", "omega of the surface"});
  keys.push_back({"sliding.damping", "sliding", AT(sliding.damping), gain, "", "zeta of the surface"});
  keys.push_back({"sliding.dead_band_m", "sliding", AT(sliding.dead_band_m), gain, "m",
                  "of the surface, within which every valve is closed"});
  keys.push_back({"sliding.every_ticks", "sliding", AT(sliding.every_ticks),
                  Range::between(1, longest_pulse_period_ticks), "ms", "between decisions"});
  keys.push_back({"phases.coarse_above_m", "phases", AT(phases.coarse_above_m), Range::positive(), "m",
                  "errors at which the cylinder comes in"});
  keys.push_back({"phases.fine_below_m", "phases", AT(phases.fine_below_m), gain, "m",
                  "errors at which it is left at rest, at most coarse_above_m"});
  keys.push_back(by_hand("phases.rest", "\"closed\"", "closed, exhaust",
                         "the chambers when the motor is alone; `exhaust` with two_way valves", "phases"));
}

void add_estimation(std::vector<VariantKey>& keys) {
  const Range positive = Range::positive(), not_negative = Range::non_negative(), memory = {0.005, 1e6, true};
  const auto add = [&keys](const char* name, VariantKey::Member member, Range range, const char* unit,
                           const char* meaning) {
    keys.push_back({std::string("estimation.") + name, "estimation", member, range, unit, meaning});
  };
  add("position_sigma_m", AT(estimation.position_sigma_m), positive, "m", "white noise of the potentiometer");
  add("position_quantum_m", AT(estimation.position_quantum_m), not_negative, "m", "converter step");
  add("position_low_m", AT(estimation.position_low_m), Range::any(), "m", "the least its channel can show");
  add("position_high_m", AT(estimation.position_high_m), {-10.0, 10.0}, "m", "the most, above position_low_m");
  add("pressure_low_pa", AT(estimation.pressure_low_pa), Range::any(), "Pa",
      "the least the sensors can show, absolute");
  add("pressure_high_pa", AT(estimation.pressure_high_pa), {-1e7, 1e7}, "Pa", "the most, above pressure_low_pa");
  add("pressure_filter_hz", AT(estimation.pressure_filter_hz), Range::between(0.0, 400.0), "Hz",
      "cut-off of the hardware Bessel filter; 0: none");
  add("pressure_sigma_pa", AT(estimation.pressure_sigma_pa), positive, "Pa", "noise after the filter");
  add("pressure_input_sigma_pa", AT(estimation.pressure_input_sigma_pa), not_negative, "Pa",
      "noise and spikes before it, as white noise held for a tick");
  add("gate_sigmas", AT(estimation.gate_sigmas), positive, "",
      "standard deviations from which innovations lose weight");
  add("force_sigma_n", AT(estimation.force_sigma_n), not_negative, "N", "external force, stationary");
  add("payload_mean_kg", AT(estimation.payload_mean_kg), not_negative, "kg", "payload expected");
  add("payload_sigma_kg", AT(estimation.payload_sigma_kg), not_negative, "kg", "its standard deviation; 0: fixed");
  add("payload_drift", AT(estimation.payload_drift), not_negative, "kg/s^0.5", "how fast it may change");
  add("flow_sigma", AT(estimation.flow_sigma), not_negative, "", "of the valves' flow factor; 0: fixed");
  add("friction_sigma", AT(estimation.friction_sigma), not_negative, "", "of the friction factor; 0: fixed");
  add("pressure_drift_pa", AT(estimation.pressure_drift_pa), positive, "Pa/s^0.5", "unmodelled flow");
  add("force_white_n", AT(estimation.force_white_n), positive, "N", "unmodelled force of one tick");
  add("force_memory_s", AT(estimation.memory.force_s), memory, "s", "time constant of the external force");
  add("flow_memory_s", AT(estimation.memory.flow_s), memory, "s", "of the flow factor");
  add("friction_memory_s", AT(estimation.memory.friction_s), memory, "s", "of the friction factor");
  add("window_ticks", AT(estimation.window_ticks), Range::between(20, 50), "ms", "of `mhe`");
  add("iterations", AT(estimation.iterations), Range::between(1, 5), "", "of `mhe`, a tick");
}
#undef AT

std::vector<VariantKey> all_keys() {
  std::vector<VariantKey> keys;
  add_common(keys);
  add_planning(keys);
  add_laws(keys);
  add_estimation(keys);
  return keys;
}

/// "cost", "switching" of "cost.switching"; no table above a key of the variant itself.
std::pair<std::string, std::string> split(const std::string& path) {
  const auto dot = path.find('.');
  return dot == std::string::npos ? std::pair{std::string(), path}
                                  : std::pair{path.substr(0, dot), path.substr(dot + 1)};
}

void read_key(TableReader& table, const std::string& name, const VariantKey& key, VariantConfig& v) {
  struct Read {
    TableReader& table;
    const std::string& name;
    const VariantKey& key;
    VariantConfig& v;
    void operator()(std::monostate) const {}
    void operator()(double& (*at)(VariantConfig&)) const { at(v) = table.number_or(name, at(v), key.range); }
    void operator()(int& (*at)(VariantConfig&)) const {
      at(v) = table.integer_or(name, at(v), static_cast<int>(key.range.low), static_cast<int>(key.range.high));
    }
    void operator()(bool& (*at)(VariantConfig&)) const { at(v) = table.boolean_or(name, at(v)); }
    void operator()(std::optional<double>& (*at)(VariantConfig&)) const {
      if (table.has(name)) at(v) = table.number(name, key.range);
    }
  };
  std::visit(Read{table, name, key, v}, key.member);
}

}  // namespace

VariantKey::Value VariantKey::value(const VariantConfig& variant) const {
  auto& v = const_cast<VariantConfig&>(variant);  // members are only read here
  struct Get {
    VariantConfig& v;
    Value operator()(std::monostate) const { return {}; }
    Value operator()(double& (*at)(VariantConfig&)) const { return at(v); }
    Value operator()(int& (*at)(VariantConfig&)) const { return at(v); }
    Value operator()(bool& (*at)(VariantConfig&)) const { return at(v); }
    Value operator()(std::optional<double>& (*at)(VariantConfig&)) const { return at(v) ? Value(*at(v)) : Value(); }
  };
  return std::visit(Get{v}, member);
}

std::string VariantKey::default_text() const {
  if (std::holds_alternative<std::monostate>(member)) return by_hand_default;
  const Value value = this->value(VariantConfig());
  if (const auto* number = std::get_if<double>(&value))
    return std::isfinite(*number) ? fmt::format("{:g}", *number) : "none";
  if (const auto* whole = std::get_if<int>(&value)) return fmt::format("{}", *whole);
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  return "none";
}

std::string VariantKey::allowed_text() const {
  if (std::holds_alternative<std::monostate>(member)) return by_hand_allowed;
  if (std::holds_alternative<bool& (*)(VariantConfig&)>(member)) return "true, false";
  if (std::holds_alternative<int& (*)(VariantConfig&)>(member))
    return fmt::format("a whole number from {:.0f} to {:.0f}", range.low, range.high);
  return range.text();
}

const std::vector<VariantKey>& variant_keys() {
  static const std::vector<VariantKey> keys = all_keys();
  return keys;
}

const VariantKey* find_variant_key(std::string_view path) {
  const auto found = std::ranges::find(variant_keys(), path, &VariantKey::path);
  return found == variant_keys().end() ? nullptr : &*found;
}

std::optional<double> default_number(std::string_view path) {
  const VariantKey* key = find_variant_key(path);
  if (!key) return {};
  const VariantKey::Value value = key->value(VariantConfig());
  if (const auto* number = std::get_if<double>(&value)) return *number;
  if (const auto* whole = std::get_if<int>(&value)) return *whole;
  return {};
}

std::string readers_of(const VariantKey& key) {
  if (key.group.empty()) return "all";
  if (key.group == "planning") return "solvers";
  if (key.group == "estimation") return "estimators";
  std::vector<std::string> readers;
  const auto collect = [&](const auto& rows) {
    for (const auto& row : rows)
      if (std::ranges::count(row.groups, key.group) > 0) readers.push_back(row.name);
  };
  collect(solver_rows());
  collect(law_rows());
  return fmt::format("{}", fmt::join(readers, ", "));
}

void read_keys(TableReader& table, std::span<const std::string> groups, VariantConfig& variant) {
  std::set<std::string> tables;
  const auto wanted = [&](const VariantKey& key) { return std::ranges::count(groups, key.group) > 0; };
  for (const VariantKey& key : variant_keys()) {
    const auto [parent, name] = split(key.path);
    if (!wanted(key)) continue;
    if (parent.empty())
      read_key(table, name, key, variant);
    else if (table.has(parent))
      tables.insert(parent);
  }
  for (const std::string& parent : tables) {
    TableReader below = table.table(parent);
    for (const VariantKey& key : variant_keys())
      if (const auto [above, name] = split(key.path); wanted(key) && above == parent) {
        below.has(name);  // keys read by hand are known here too
        read_key(below, name, key, variant);
      }
    below.finish();
  }
}

}  // namespace solenoid
