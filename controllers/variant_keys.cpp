#include "controllers/variant_keys.hpp"

#include "controllers/networks.hpp"
#include "controllers/systems.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

// Where a key's value lives in the variant.
#define AT(member) [](VariantConfig& v) -> decltype((v.member)) { return v.member; }

void add_choices(const KeyGroup& all, const SystemDescription& system, const std::vector<std::string>& solvers_and_laws,
                 const std::vector<std::string>& mode_sets, const std::vector<std::string>& estimators,
                 const std::vector<std::string>& parameter_sets) {
  all.by_hand("system", fmt::format("\"{}\"", system.name), "`list systems`", "whose controller it is");
  all.text("summary", VariantKey::At<std::string>(AT(summary)), {}, "one line for `list`");
  all.text(system.modes_key, VariantKey::At<std::string>(AT(modes)), mode_sets, "the mode set");
  all.by_hand("model", parameter_sets.empty() ? "none" : fmt::format("\"{}\"", parameter_sets.front()),
              parameter_sets.empty() ? "a file in .toml, a table" : "`list parameters`, a file in .toml, a table",
              "the parameters that the controller believes");
  all.add("timing.tick_ms", VariantKey::At<std::optional<double>>(AT(own_timing.tick_ms)), tick_range_ms, "ms",
          "sampling of estimators, laws and model steps; none: the scenario's or the system's");
  all.add("timing.period_ms", VariantKey::At<std::optional<double>>(AT(own_timing.period_ms)), period_range_ms, "ms",
          "of predictive control, whole ticks; none: the scenario's or the system's");
  all.text("estimator", VariantKey::At<std::string>(AT(estimator)), estimators, "what makes the state of the sensors");
  all.text("solver", VariantKey::At<std::string>(AT(solver)), solvers_and_laws, "what chooses the modes");
}

/// A weight of an output, or of that at the end.
void add_weight(const KeyGroup& all, const OutputSource& output, std::size_t index, bool terminal) {
  const VariantKey::At<double> at = [index, terminal](VariantConfig& v) -> double& {
    return terminal ? v.cost.terminal[index] : v.cost.tracking[index];
  };
  all.add(
      (terminal ? "cost.terminal_" : "cost.") + output.name, at, Range::non_negative(), output.weight_unit,
      fmt::format("weight of the squared error of {} at {}", output.name, terminal ? "the last step" : "each step"));
}

void add_costs(const KeyGroup& all, const SystemDescription& system) {
  for (const bool terminal : {false, true})
    for (std::size_t i = 0; i < system.outputs.size(); ++i) add_weight(all, system.outputs[i], i, terminal);
  all.add("cost.switching", VariantKey::At<double>(AT(cost.switching)), Range::non_negative(), "",
          fmt::format("of each {} change", system.switch_noun));
  if (const Signal& c = system.consumption; !c.name.empty())
    all.add("cost." + c.name, VariantKey::At<double>(AT(cost.consumption)), Range::non_negative(), "1/" + c.unit,
            fmt::format("of the {} drawn", c.label));
  for (std::size_t i = 0; i < system.continuous.size(); ++i) {
    const Signal& input = system.continuous[i];
    all.add("cost." + input.name,
            VariantKey::At<double>([i](VariantConfig& v) -> double& { return v.cost.continuous[i]; }),
            Range::non_negative(), fmt::format("1/{}2", input.unit),
            fmt::format("of the squared {} input that a joint plan chooses, at each step", input.label));
  }
}

/// "1/m2", "1/(m/s)2".
std::string per_square(const std::string& unit) {
  return unit.find('/') == std::string::npos ? fmt::format("1/{}2", unit) : fmt::format("1/({})2", unit);
}

/// What plans keep to: of every switch alike, and of each state.
void add_limits(const KeyGroup& all, const SystemDescription& system) {
  const std::string& noun = system.switch_noun;
  all.add("limits.least_on_ms", VariantKey::At<std::optional<double>>(AT(limits.least_on_ms)), {0.0, 1e5, true}, "ms",
          fmt::format("a {} stays on at least so long", noun));
  all.add("limits.least_off_ms", VariantKey::At<std::optional<double>>(AT(limits.least_off_ms)), {0.0, 1e5, true}, "ms",
          fmt::format("and off", noun));
  all.add("limits.most_changes", VariantKey::At<int>(AT(limits.most_changes)), Range::between(0, 64), "",
          fmt::format("of each {} within limits.window_ms; 0: any number", noun));
  all.add("limits.window_ms", VariantKey::At<std::optional<double>>(AT(limits.window_ms)), {0.0, 1e6, true}, "ms",
          "any stretch of time as long as this");
  for (std::size_t i = 0; i < system.states.size(); ++i) {
    const Signal& state = system.states[i];
    all.add("limits.least_" + limited_state_key(state),
            VariantKey::At<std::optional<double>>([i](VariantConfig & v) -> auto& { return v.limits.least[i]; }), {},
            state.unit, fmt::format("lower bound of the predicted {}", state.label));
    all.add("limits.most_" + limited_state_key(state),
            VariantKey::At<std::optional<double>>([i](VariantConfig & v) -> auto& { return v.limits.most[i]; }), {},
            state.unit, fmt::format("upper bound of the predicted {}", state.label));
    all.add("limits.penalty_" + state.name,
            VariantKey::At<double>([i](VariantConfig& v) -> double& { return v.limits.penalty[i]; }),
            Range::non_negative(), per_square(state.unit),
            "of the squared excess over these bounds at each step, which softens them; 0: no plan leaves them");
  }
}

/// Of solvers that draw sequences of modes.
void add_sampling(std::vector<VariantKey>& keys) {
  const KeyGroup all{keys, "sampling"}, elites{keys, "elites"}, weights{keys, "weights"};
  all.add("sampling.samples", VariantKey::At<int>(AT(sampling.samples)), Range::between(1, 10'000'000), "",
          "sequences of modes tried in a solve; with deadline_ms as many of them as there is time for");
  all.add("sampling.iterations", VariantKey::At<int>(AT(sampling.iterations)), Range::between(1, 100'000), "",
          "updates of the distribution they are drawn from, at most sampling.samples");
  elites.add("sampling.elites", VariantKey::At<double>(AT(sampling.elites)), {1e-6, 1.0, true}, "",
             "share of an iteration's samples that the distribution is fitted to");
  weights.add("sampling.temperature", VariantKey::At<double>(AT(sampling.temperature)), Range::positive(), "",
              "lambda of a sample's weight exp(-(J - J_min) / (lambda (J_mean - J_min)))");
  all.add("sampling.smoothing", VariantKey::At<double>(AT(sampling.smoothing)), Range::between(0.0, 1.0), "",
          "share of the distribution before an update that stays in it");
  all.add("sampling.mutation", VariantKey::At<double>(AT(sampling.mutation)), Range::between(0.0, 1.0), "",
          "probability that a block of a sample flips one switch of its mode");
  all.add("sampling.seed", VariantKey::At<int>(AT(sampling.seed)), Range::between(0, 1'000'000'000), "",
          "of the draws");
}

void add_minlp(const KeyGroup& all) {
  all.text("minlp.algorithm", VariantKey::At<std::string>(AT(minlp.algorithm)),
           {"branch_and_bound", "outer_approximation", "feasibility_pump"},
           "how Bonmin goes about it: B-BB, B-OA, B-iFP");
}

void add_modulation(const KeyGroup& all) {
  all.text("modulation.kind", VariantKey::At<std::string>(AT(modulation.kind)),
           {"pulse_width", "delta_sigma", "delta_sigma_2", "dynamic_quantiser"},
           "what makes single steps of a relaxed plan: docs/theory/theory-relaxed.md, section 6");
  all.flag("modulation.informed", VariantKey::At<bool>(AT(modulation.informed)),
           "whether the relaxed plan begins with what the modulator is about to make up for");
  all.add("modulation.edge_price", VariantKey::At<double>(AT(modulation.edge_price)), Range::between(0.0, 1000.0), "",
          "what a change has to gain, in squared steps that are owed");
}

void add_planning(const KeyGroup& all, const KeyGroup& rounding, const KeyGroup& relaxing,
                  const SystemDescription& system) {
  all.add("latency_ticks", VariantKey::At<int>(AT(latency_ticks)), Range::between(0, 1000), "ticks",
          "from a measurement to the effect of its plan; the solver starts from the state forecast to then");
  all.add("deadline_ms", VariantKey::At<std::optional<double>>(AT(deadline_ms)), {0.0, 1e6, true}, "ms",
          "budget of one solve; a solve beyond it returns its best plan so far");
  all.add("horizon.steps", VariantKey::At<int>(AT(horizon.steps)), Range::between(1, 1000), "ticks",
          "N_p, model steps");
  all.add("horizon.blocks", VariantKey::At<std::vector<int>>(AT(horizon.blocks)), Range::between(1, 200), "",
          "lengths in control periods that add up to the steps, in each of which the mode is constant; none: one");
  add_costs(all, system);
  rounding.flag("rounding.improve", VariantKey::At<bool>(AT(rounding.improve)),
                "mode swaps, and for joint plans the continuous inputs re-optimised, after rounding");
  relaxing.add("rounding.iterations", VariantKey::At<int>(AT(rounding.iterations)), Range::between(0, 10000), "",
               "of the relaxation before rounding or pulses");
  all.add("integral.gain", VariantKey::At<double>(AT(integral.gain)), Range::non_negative(), "",
          "of the integral offset of the references, per sample; 0.005 in the thesis");
  all.add("integral.forgetting", VariantKey::At<double>(AT(integral.forgetting)), Range::between(0.0, 1.0), "",
          "factor on the running sum each sample");
  const std::string& unit = system.axes.front().signal.unit;
  all.add("integral.limit_" + unit_in_keys(unit), VariantKey::At<double>(AT(integral.limit_m)), Range::positive(), unit,
          "bound of the offset");
}

void add_learned(const KeyGroup& learned, const KeyGroup& tail) {
  learned.network("learned.network", VariantKey::At<std::string>(AT(learned.network)),
                  "what was taught (docs/how-to/learning.md): scores of modes, or what the blocks left cost");
  tail.add("learned.searched_blocks", VariantKey::At<int>(AT(learned.searched_blocks)), Range::between(1, 31), "",
           "of the horizon that are searched before the learned cost of the others");
}
#undef AT

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
  void operator()(const VariantKey::At<double>& at) const { at(v) = table.number_or(name, at(v), key.range); }
  void operator()(const VariantKey::At<int>& at) const { at(v) = table.integer_or(name, at(v), low(), high()); }
  void operator()(const VariantKey::At<bool>& at) const { at(v) = table.boolean_or(name, at(v)); }
  void operator()(const VariantKey::At<std::string>& at) const {
    at(v) = table.text_or(name, at(v), key.choices);
    if (key.names_network && is_network_file(at(v))) at(v) = table.file(name).path;
  }
  void operator()(const VariantKey::At<std::vector<int>>& at) const {
    if (table.has(name)) at(v) = table.integers(name, low(), high());
  }
  void operator()(const VariantKey::At<std::optional<double>>& at) const {
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
  VariantKey::Value operator()(const auto& at) const { return at(v); }
  VariantKey::Value operator()(const VariantKey::At<std::optional<double>>& at) const {
    return at(v) ? VariantKey::Value(*at(v)) : VariantKey::Value();
  }
};

/// What may stand there, as the documentation has it.
struct AllowedText {
  const VariantKey& key;
  std::string operator()(std::monostate) const { return key.by_hand_allowed; }
  std::string operator()(const VariantKey::At<bool>&) const { return "true, false"; }
  std::string operator()(const VariantKey::At<int>&) const { return whole("a whole number"); }
  std::string operator()(const VariantKey::At<std::vector<int>>&) const { return whole("a list of whole numbers"); }
  std::string operator()(const VariantKey::At<std::string>&) const {
    if (key.names_network) return "a shipped one's name, a file in .toml";
    return key.choices.empty() ? "a text" : fmt::format("{}", fmt::join(key.choices, ", "));
  }
  std::string operator()(const auto&) const { return key.range.text(); }
  std::string whole(const char* what) const {
    return fmt::format("{} from {:g} to {:g}", what, key.range.low, key.range.high);
  }
};

}  // namespace

VariantKey::Value VariantKey::value(const VariantConfig& variant) const {
  return std::visit(Get{const_cast<VariantConfig&>(variant)}, member);  // members are only read
}

std::string VariantKey::default_text(const VariantConfig& defaults) const {
  return by_hand_default.empty() ? std::visit(DefaultText(), value(defaults)) : by_hand_default;
}

std::string VariantKey::allowed_text() const { return std::visit(AllowedText{*this}, member); }

void KeyGroup::add(const std::string& path, VariantKey::Member at, Range range, const std::string& unit,
                   const std::string& meaning) const {
  keys.push_back({path, group, std::move(at), range, unit, meaning});
}
void KeyGroup::flag(const std::string& path, VariantKey::Member at, const std::string& meaning) const {
  add(path, std::move(at), {}, "", meaning);
}
void KeyGroup::text(const std::string& path, VariantKey::Member at, std::vector<std::string> choices,
                    const std::string& meaning) const {
  keys.push_back({path, group, std::move(at), {}, "", meaning, std::move(choices)});
}
void KeyGroup::network(const std::string& path, VariantKey::Member at, const std::string& meaning) const {
  keys.push_back({path, group, std::move(at), {}, "", meaning});
  keys.back().names_network = true;
}
void KeyGroup::by_hand(const std::string& path, const std::string& fallback, const std::string& allowed,
                       const std::string& meaning) const {
  keys.push_back({path, group, {}, {}, "", meaning, {}, fallback, allowed});
}

std::vector<VariantKey> common_keys(const SystemDescription& system, const std::vector<std::string>& solvers,
                                    const std::vector<std::string>& laws, const std::vector<std::string>& mode_sets,
                                    const std::vector<std::string>& estimators,
                                    const std::vector<std::string>& parameter_sets) {
  std::vector<VariantKey> keys;
  std::vector<std::string> choosers = solvers;
  choosers.insert(choosers.end(), laws.begin(), laws.end());
  add_choices({keys, ""}, system, choosers, mode_sets, estimators, parameter_sets);
  add_planning({keys, "planning"}, {keys, "rounding"}, {keys, "relaxing"}, system);
  add_sampling(keys);
  add_minlp({keys, "minlp"});
  add_modulation({keys, "modulation"});
  add_limits({keys, "limits"}, system);
  add_learned({keys, "learned"}, {keys, "learned_tail"});
  return keys;
}

std::string limited_state_key(const Signal& state) {
  std::string key = state.unit.empty() ? state.name : state.name + "_" + unit_in_keys(state.unit);
  std::ranges::replace(key, '/', '_');
  return key;
}

const VariantKey* find_variant_key(const System& system, std::string_view path) {
  const auto found = std::ranges::find(system.keys(), path, &VariantKey::path);
  return found == system.keys().end() ? nullptr : &*found;
}

std::optional<double> default_number(const System& system, std::string_view path) {
  const VariantKey* key = find_variant_key(system, path);
  if (!key) return {};
  const VariantKey::Value value = key->value(new_variant(&system));
  if (const auto* number = std::get_if<double>(&value)) return *number;
  if (const auto* whole = std::get_if<int>(&value)) return *whole;
  return {};
}

std::string readers_of(const System& system, const VariantKey& key) {
  if (key.group.empty()) return "all";
  if (key.group == "planning") return "solvers";
  if (key.group == "estimation") return "estimators";
  std::vector<std::string> readers;
  const auto collect = [&](const auto& rows) {
    for (const auto& row : rows)
      if (std::ranges::count(row.groups, key.group) > 0) readers.push_back(row.name);
  };
  collect(system.solvers());
  collect(system.laws());
  return fmt::format("{}", fmt::join(readers, ", "));
}

void read_keys(TableReader& table, std::span<const std::string> groups, VariantConfig& variant) {
  const std::vector<VariantKey>& keys = system_of(variant).keys();
  std::set<std::string> tables;
  const auto wanted = [&](const VariantKey& key) { return std::ranges::count(groups, key.group) > 0; };
  for (const VariantKey& key : keys) {
    const auto [parent, name] = split(key.path);
    if (!wanted(key)) continue;
    if (parent.empty())
      read_key(table, name, key, variant);
    else if (table.has(parent))
      tables.insert(parent);
  }
  for (const std::string& parent : tables) {
    TableReader below = table.table(parent);
    for (const VariantKey& key : keys)
      if (const auto [above, name] = split(key.path); wanted(key) && above == parent)
        read_key(below, name, key, variant);
    below.finish();
  }
}

}  // namespace solenoid
