#include "controllers/variant_keys.hpp"

#include "controllers/catalogue.hpp"
#include "core/systems/actuator/valves.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr double longest_pulse_period_ticks = 200;

std::vector<std::string> solvers_and_laws() {
  std::vector<std::string> names = names_of(solver_rows());
  std::ranges::copy(names_of(law_rows()), std::back_inserter(names));
  return names;
}

/// Adds keys that the same solvers, laws or estimators read.
struct Group {
  std::vector<VariantKey>& keys;
  std::string group;

  void add(const char* path, VariantKey::Member at, Range range, const char* unit, const char* meaning) const {
    keys.push_back({path, group, at, range, unit, meaning});
  }
  void flag(const char* path, VariantKey::Member at, const char* meaning) const { add(path, at, {}, "", meaning); }
  void text(const char* path, VariantKey::Member at, std::vector<std::string> choices, const char* meaning) const {
    keys.push_back({path, group, at, {}, "", meaning, std::move(choices)});
  }
  void by_hand(const char* path, const char* fallback, const char* allowed, const char* meaning) const {
    keys.push_back({path, group, {}, {}, "", meaning, {}, fallback, allowed});
  }
};

// A key's member: where its value lives in the variant.
#define AT(member) +[](VariantConfig& v) -> decltype((v.member)) { return v.member; }

void add_common(const Group& all) {
  all.text("summary", AT(summary), {}, "one line for `list`");
  all.text("valves", AT(valves), valve_configurations(), "the mode set");
  all.by_hand("model", "\"consistent\"", "`list parameters`, a file in .toml, a table",
              "the parameters that the controller believes");
  all.add("timing.tick_ms", AT(own_timing.tick_ms), tick_range_ms, "ms",
          "sampling of estimators, laws and model steps; none: the scenario's or the system's");
  all.add("timing.period_ms", AT(own_timing.period_ms), period_range_ms, "ms",
          "of predictive control, whole ticks; none: the scenario's or the system's");
  all.text("estimator", AT(estimator), names_of(estimator_rows()), "what makes the state of the sensors");
  all.by_hand("use_estimate", "\"state\"", "state, payload, disturbance, payload_and_disturbance",
              "what of the estimate the prediction, and a motor law with inverse dynamics, uses");
  all.text("solver", AT(solver), solvers_and_laws(), "what chooses the modes");
  all.text(
      "motor", AT(motor), {"none", "pd", "inverse_dynamics", "in_prediction", "joint"},
      "the motor's law; `in_prediction`: pd, and the prediction knows it; `joint`: a planned force, on top of that "
      "law, or in its place with `sqp` and `ipopt`");
  all.add("motor_gains.proportional", AT(motor_gains.proportional), Range::non_negative(), "N/m", "K_pe");
  all.add("motor_gains.derivative", AT(motor_gains.derivative), Range::non_negative(), "N s/m", "K_de");
}

void add_planning(const Group& all, const Group& cost_of_end, const Group& rounding) {
  const Range weight = Range::non_negative();
  all.add("latency_ticks", AT(latency_ticks), Range::between(0, 1000), "ticks",
          "from a measurement to the effect of its plan; the solver starts from the state forecast to then");
  all.add("deadline_ms", AT(deadline_ms), {0.0, 1e6, true}, "ms",
          "budget of one solve; a solve beyond it returns its best plan so far");
  all.add("horizon.steps", AT(horizon.steps), Range::between(1, 1000), "ticks", "N_p, model steps");
  all.add("horizon.blocks", AT(horizon.blocks), Range::between(1, 200), "",
          "lengths in control periods that add up to the steps, in each of which the mode is constant; none: one");
  all.add("cost.position", AT(cost.position), weight, "1/m2", "weight of the squared position error at each step");
  all.add("cost.velocity", AT(cost.velocity), weight, "s2/m2", "of the squared velocity error");
  all.add("cost.switching", AT(cost.switching), weight, "", "of each coil change");
  all.add("cost.air", AT(cost.air), weight, "1/kg", "of the supply air drawn");
  all.add("cost.terminal_position", AT(cost.terminal_position), weight, "1/m2",
          "of the squared position error at the last step");
  all.add("cost.terminal_velocity", AT(cost.terminal_velocity), weight, "s2/m2",
          "of the squared velocity error at the last step");
  all.add("cost.motor", AT(cost.motor), weight, "1/N2",
          "of the squared motor force that a joint plan chooses, at each step");
  cost_of_end.add("cost.terminal_acceleration", AT(cost.terminal_acceleration), weight, "s4/m2",
                  "of the squared acceleration error at the last step, what the pressures there bring about");
  rounding.flag("rounding.improve", AT(rounding.improve),
                "mode swaps, and for joint plans the motor force re-optimised, after rounding");
  rounding.add("rounding.iterations", AT(rounding.iterations), Range::between(0, 10000), "",
               "of the relaxation before rounding");
  all.add("integral.gain", AT(integral.gain), weight, "",
          "of the integral offset of the valves' reference, per 1 ms sample; 0.005 in the thesis");
  all.add("integral.forgetting", AT(integral.forgetting), Range::between(0.0, 1.0), "",
          "factor on the running sum each sample");
  all.add("integral.limit_m", AT(integral.limit_m), Range::positive(), "m", "bound of the offset");
}

void add_pulse_width(const Group& law) {
  const Range gain = Range::non_negative(), share = Range::between(0.0, 1.0);
  law.add("pulse_width.proportional", AT(pulse_width.proportional), gain, "1/m",
          "gain on the position error; duties are of full scale, -1 to 1");
  law.add("pulse_width.integral", AT(pulse_width.integral), gain, "1/(m s)", "gain");
  law.add("pulse_width.derivative", AT(pulse_width.derivative), gain, "s/m", "gain");
  law.add("pulse_width.integral_limit", AT(pulse_width.integral_limit), share, "", "bound of the integral's share");
  law.add("pulse_width.feedforward", AT(pulse_width.feedforward), gain, "1/m",
          "gain on the desired position's change over the coming lead_s");
  law.add("pulse_width.lead_s", AT(pulse_width.lead_s), share, "s", "of the feedforward");
  law.add("pulse_width.friction", AT(pulse_width.friction), share, "", "share against Coulomb friction");
  law.add("pulse_width.friction_band_m", AT(pulse_width.friction_band_m), gain, "m",
          "errors that are left alone at rest");
  law.add("pulse_width.bias", AT(pulse_width.bias), share, "", "duty of both valves at u = 0");
  law.add("pulse_width.period_ticks", AT(pulse_width.period_ticks), Range::between(5, longest_pulse_period_ticks),
          "ticks", "of the pulses and of the law");
}

void add_sliding(const Group& surface, const Group& phases) {
  const Range gain = Range::non_negative();
  surface.add("sliding.frequency", AT(sliding.frequency), Range::positive(), "rad/s", "omega of the surface");
  surface.add("sliding.damping", AT(sliding.damping), gain, "", "zeta of the surface");
  surface.add("sliding.dead_band_m", AT(sliding.dead_band_m), gain, "m",
              "of the surface, within which every valve is closed");
  surface.add("sliding.every_ticks", AT(sliding.every_ticks), Range::between(1, longest_pulse_period_ticks), "ticks",
              "between decisions");
  phases.add("phases.coarse_above_m", AT(phases.coarse_above_m), Range::positive(), "m",
             "errors at which the cylinder comes in");
  phases.add("phases.fine_below_m", AT(phases.fine_below_m), gain, "m",
             "errors at which it is left at rest, at most coarse_above_m");
  phases.text("phases.rest", AT(phases.rest), {"closed", "exhaust"},
              "the chambers when the motor is alone; `exhaust` with two_way valves");
}

void add_estimation(const Group& all) {
  const Range positive = Range::positive(), not_negative = Range::non_negative(), memory = {0.005, 1e6, true};
  all.add("estimation.position_sigma_m", AT(estimation.position_sigma_m), positive, "m",
          "white noise of the potentiometer");
  all.add("estimation.position_quantum_m", AT(estimation.position_quantum_m), not_negative, "m", "converter step");
  all.add("estimation.position_low_m", AT(estimation.position_low_m), Range::any(), "m",
          "the least its channel can show");
  all.add("estimation.position_high_m", AT(estimation.position_high_m), {-10.0, 10.0}, "m",
          "the most, above position_low_m");
  all.add("estimation.pressure_low_pa", AT(estimation.pressure_low_pa), Range::any(), "Pa",
          "the least the sensors can show, absolute");
  all.add("estimation.pressure_high_pa", AT(estimation.pressure_high_pa), {-1e7, 1e7}, "Pa",
          "the most, above pressure_low_pa");
  all.add("estimation.pressure_filter_hz", AT(estimation.pressure_filter_hz), Range::between(0.0, 400.0), "Hz",
          "cut-off of the hardware Bessel filter; 0: none");
  all.add("estimation.pressure_sigma_pa", AT(estimation.pressure_sigma_pa), positive, "Pa", "noise after the filter");
  all.add("estimation.pressure_input_sigma_pa", AT(estimation.pressure_input_sigma_pa), not_negative, "Pa",
          "noise and spikes before it, as white noise held for a tick");
  all.add("estimation.gate_sigmas", AT(estimation.gate_sigmas), positive, "",
          "standard deviations from which innovations lose weight");
  all.add("estimation.force_sigma_n", AT(estimation.force_sigma_n), not_negative, "N", "external force, stationary");
  all.add("estimation.payload_mean_kg", AT(estimation.payload_mean_kg), not_negative, "kg", "payload expected");
  all.add("estimation.payload_sigma_kg", AT(estimation.payload_sigma_kg), not_negative, "kg",
          "its standard deviation; 0: fixed");
  all.add("estimation.payload_drift", AT(estimation.payload_drift), not_negative, "kg/s^0.5", "how fast it may change");
  all.add("estimation.flow_sigma", AT(estimation.flow_sigma), not_negative, "", "of the valves' flow factor; 0: fixed");
  all.add("estimation.friction_sigma", AT(estimation.friction_sigma), not_negative, "",
          "of the friction factor; 0: fixed");
  all.add("estimation.pressure_drift_pa", AT(estimation.pressure_drift_pa), positive, "Pa/s^0.5", "unmodelled flow");
  all.add("estimation.force_white_n", AT(estimation.force_white_n), positive, "N", "unmodelled force of one tick");
  all.add("estimation.force_memory_s", AT(estimation.memory.force_s), memory, "s",
          "time constant of the external force");
  all.add("estimation.flow_memory_s", AT(estimation.memory.flow_s), memory, "s", "of the flow factor");
  all.add("estimation.friction_memory_s", AT(estimation.memory.friction_s), memory, "s", "of the friction factor");
  all.add("estimation.window_ticks", AT(estimation.window_ticks), Range::between(20, 50), "ticks", "of `mhe`");
  all.add("estimation.iterations", AT(estimation.iterations), Range::between(1, 5), "", "of `mhe`, a tick");
}
#undef AT

std::vector<VariantKey> all_keys() {
  std::vector<VariantKey> keys;
  const auto read_by = [&keys](const char* group) { return Group{keys, group}; };
  add_common(read_by(""));
  add_planning(read_by("planning"), read_by("extended_cost"), read_by("rounding"));
  add_pulse_width(read_by("pulse_width"));
  add_sliding(read_by("sliding"), read_by("phases"));
  add_estimation(read_by("estimation"));
  return keys;
}

/// "cost", "switching" of "cost.switching"; no table above a key of the variant itself.
std::pair<std::string, std::string> split(const std::string& path) {
  const auto dot = path.find('.');
  return dot == std::string::npos ? std::pair{std::string(), path}
                                  : std::pair{path.substr(0, dot), path.substr(dot + 1)};
}

/// Reads what the table has there, if it has.
struct ReadKey {
  TableReader& table;
  const std::string& name;
  const VariantKey& key;
  VariantConfig& v;
  int low() const { return static_cast<int>(key.range.low); }
  int high() const { return static_cast<int>(key.range.high); }

  void operator()(std::monostate) const {}
  void operator()(VariantKey::At<double> at) const { at(v) = table.number_or(name, at(v), key.range); }
  void operator()(VariantKey::At<int> at) const { at(v) = table.integer_or(name, at(v), low(), high()); }
  void operator()(VariantKey::At<bool> at) const { at(v) = table.boolean_or(name, at(v)); }
  void operator()(VariantKey::At<std::string> at) const { at(v) = table.text_or(name, at(v), key.choices); }
  void operator()(VariantKey::At<std::vector<int>> at) const {
    if (table.has(name)) at(v) = table.integers(name, low(), high());
  }
  void operator()(VariantKey::At<std::optional<double>> at) const {
    if (table.has(name)) at(v) = table.number(name, key.range);
  }
};

void read_key(TableReader& table, const std::string& name, const VariantKey& key, VariantConfig& v) {
  std::visit(ReadKey{table, name, key, v}, key.member);
}

/// A default as the documentation has it.
struct DefaultText {
  std::string operator()(std::monostate) const { return "none"; }
  std::string operator()(double number) const { return std::isfinite(number) ? fmt::format("{:g}", number) : "none"; }
  std::string operator()(int whole) const { return fmt::format("{}", whole); }
  std::string operator()(bool flag) const { return flag ? "true" : "false"; }
  std::string operator()(const std::string& text) const { return text.empty() ? "none" : fmt::format("\"{}\"", text); }
  std::string operator()(const std::vector<int>& list) const { return fmt::format("{}", list); }
};

/// What a variant has there.
struct Get {
  VariantConfig& v;
  VariantKey::Value operator()(std::monostate) const { return {}; }
  VariantKey::Value operator()(auto at) const { return at(v); }
  VariantKey::Value operator()(VariantKey::At<std::optional<double>> at) const {
    return at(v) ? VariantKey::Value(*at(v)) : VariantKey::Value();
  }
};

/// What may stand there, as the documentation has it.
struct AllowedText {
  const VariantKey& key;
  std::string operator()(std::monostate) const { return key.by_hand_allowed; }
  std::string operator()(VariantKey::At<bool>) const { return "true, false"; }
  std::string operator()(VariantKey::At<int>) const { return whole("a whole number"); }
  std::string operator()(VariantKey::At<std::vector<int>>) const { return whole("a list of whole numbers"); }
  std::string operator()(VariantKey::At<std::string>) const {
    return key.choices.empty() ? "a text" : fmt::format("{}", fmt::join(key.choices, ", "));
  }
  std::string operator()(auto) const { return key.range.text(); }
  std::string whole(const char* what) const {
    return fmt::format("{} from {:g} to {:g}", what, key.range.low, key.range.high);
  }
};

}  // namespace

VariantKey::Value VariantKey::value(const VariantConfig& variant) const {
  return std::visit(Get{const_cast<VariantConfig&>(variant)}, member);  // members are only read
}

std::string VariantKey::default_text() const {
  return by_hand_default.empty() ? std::visit(DefaultText(), value(VariantConfig())) : by_hand_default;
}

std::string VariantKey::allowed_text() const { return std::visit(AllowedText{*this}, member); }

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
      if (const auto [above, name] = split(key.path); wanted(key) && above == parent)
        read_key(below, name, key, variant);
    below.finish();
  }
}

}  // namespace solenoid
