#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/dynamics.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/rig/node_protocol.hpp"

#include <algorithm>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

/// "payload 0.1 kg" of a scenario.
std::string conditions_text(const ScenarioConfig& s) {
  const std::vector<Signal>& conditions = system_of(s).description().conditions;
  const std::vector<double> values = simulation_of(s).conditions(s);
  std::string text;
  for (std::size_t i = 0; i < conditions.size(); ++i)
    text += fmt::format("{}{} {:g}{}{}", i ? ", " : "", conditions[i].label, values[i],
                        conditions[i].unit.empty() ? "" : " ", conditions[i].unit);
  return text;
}

/// Of which systems: one by name, or all.
std::vector<const System*> chosen_systems(const std::string& name) {
  if (name.empty()) return {systems().begin(), systems().end()};
  if (const System* system = find_system(name)) return {system};
  throw ConfigError(fmt::format("--system: '{}' is not known (allowed: {})", name, system_names()));
}

bool chosen(const System& system, const std::string& name) {
  return std::ranges::count(chosen_systems(name), &system) > 0;
}

Json list_systems(const std::string& only) {
  Json list = Json::array();
  for (const System* system : chosen_systems(only)) {
    const SystemDescription& d = system->description();
    std::vector<std::string> axes;
    for (const Axis& axis : d.axes) axes.push_back(fmt::format("{} [{}]", axis.signal.name, axis.shown_unit));
    list.push_back({{"name", d.name},
                    {"axes", axes},
                    {"states", d.states.size()},
                    {"continuous", d.continuous.size()},
                    {"tick_ms", 1e3 * d.timing.tick_s},
                    {"period_ms", 1e3 * d.timing.period_s()},
                    {"modes", system->mode_sets()},
                    {"summary", d.summary}});
  }
  return list;
}

Json list_variants(const std::string& only) {
  Json list = Json::array();
  for (const VariantConfig& v : shipped_variants())
    if (chosen(system_of(v), only))
      list.push_back({{"name", v.name},
                      {"system", system_of(v).name()},
                      {"modes", v.modes},
                      {"solver", v.solver},
                      {"estimator", v.estimator},
                      {"summary", v.summary}});
  return list;
}

Json list_scenarios(const std::string& only) {
  Json list = Json::array();
  for (const std::string& name : shipped_campaigns())
    for (const ScenarioConfig& s : read_campaign(name).scenarios)
      if (chosen(system_of(s), only))
        list.push_back({{"campaign", name},
                        {"name", s.name},
                        {"system", system_of(s).name()},
                        {"trajectory", s.trajectory_kind},
                        {"setting", s.setting},
                        {"conditions", conditions_text(s)},
                        {"noise", s.noise},
                        {"duration_s", s.duration_s}});
  return list;
}

/// Of the actuator, whose sets have names.
Json list_parameters(const std::string& only) {
  Json list = Json::array();
  if (std::ranges::all_of(chosen_systems(only), [](const System* s) { return s->parameter_sets().empty(); }))
    return list;
  const auto add = [&](const char* name, const char* summary) {
    const ActuatorParameters p = named_parameters(name);
    list.push_back({{"name", name},
                    {"choked_flow_kg_s", p.choked_flow},
                    {"equivalent_mass_kg", p.equivalent_mass_kg()},
                    {"gravity_torque_nm", p.gravity_torque_nm()},
                    {"equilibrium_mm", 1e3 * p.equilibrium_position_m()},
                    {"rod_atmosphere", p.rod_atmosphere},
                    {"summary", summary}});
  };
  add("consistent", "default: choked flow continuous with both flow laws (E2)");
  add("printed", "choked flow as printed, tenfold (E2)");
  add("inferred", "inertia and arm torque the thesis's percentages imply (E8)");
  add("printed+inferred", "both");
  add("consistent+no_rod_atmosphere", "without P_0 on the rod's area (E9), as (4.3) prints it");
  return list;
}

/// Calls f(system, variant, modes) for each set of modes that the chosen systems have, the variant a new one with it.
template <class F>
void for_each_mode_set(const std::string& only, const F& f) {
  for (const System* system : chosen_systems(only))
    for (const std::string& name : system->mode_sets()) {
      VariantConfig variant = new_variant(system);
      variant.modes = name;
      f(system, variant, system->modes(variant));
    }
}

/// Of a bank of valves the first few states say how the others are called.
Json list_modes(const std::string& only) {
  constexpr int most_listed = 30, first_listed = 5;
  Json list = Json::array();
  for_each_mode_set(only, [&](const System* system, const VariantConfig& variant, const ModeSet& modes) {
    std::vector<std::string> switches, states;
    for (const Switch& each : modes.switches()) switches.push_back(each.name);
    for (const Mode& mode : modes.modes())
      if (modes.size() <= most_listed || static_cast<int>(states.size()) < first_listed) states.push_back(mode.name);
    if (modes.size() > most_listed) states.push_back(fmt::format("{} more", modes.size() - first_listed));
    list.push_back({{"system", system->name()},
                    {"name", variant.modes},
                    {"modes", modes.size()},
                    {"switches", switches},
                    {"states", states}});
  });
  return list;
}

/// What an I/O node for each set of modes is told: text, inputs and outputs, to the letter.
Json list_wires(const std::string& only) {
  Json list = Json::array();
  for_each_mode_set(only, [&](const System* system, const VariantConfig& variant, const ModeSet& modes) {
    const SystemDescription& described = system->description_for(variant);
    std::string wire;
    try {
      wire = wire_text(described, modes);
    } catch (const ConfigError& too_long) {
      wire = std::string("none: ") + too_long.what();
    }
    list.push_back({{"system", system->name()},
                    {"modes", variant.modes},
                    {"channels", described.channels.size()},
                    {"outputs", described.continuous.size()},
                    {"switches", modes.switch_count()},
                    {"safe_switches", modes.safe_pattern()},
                    {"wire", wire}});
  });
  return list;
}

Json list_solvers(const std::string& only) {
  Json list = Json::array();
  for (const System* system : chosen_systems(only))
    for (const SolverRow& row : system->solvers())
      if (std::ranges::count(list, Json(row.name), [](const Json& j) { return j["name"]; }) == 0)
        list.push_back({{"name", row.name},
                        {"real_time", row.real_time},
                        {"continuous", row.chooses_continuous},
                        {"pulses", row.pulses},
                        {"modes", row.modes.empty() ? std::vector<std::string>{"all"} : row.modes},
                        {"summary", row.summary}});
  return list;
}

Json list_laws(const std::string& only) {
  Json list = Json::array();
  for (const System* system : chosen_systems(only))
    for (const LawRow& row : system->laws())
      list.push_back({{"system", system->name()},
                      {"name", row.name},
                      {"tables", row.groups},
                      {"modes", row.modes},
                      {"summary", row.summary}});
  return list;
}

Json list_estimators(const std::string& only) {
  Json list = Json::array();
  for (const System* system : chosen_systems(only))
    for (const EstimatorName& row : system->estimators())
      list.push_back({{"system", system->name()}, {"name", row.name}, {"summary", row.summary}});
  return list;
}

/// Of one system: the first, unless another is named.
Json list_keys(const std::string& only) {
  Json list = Json::array();
  const System& system = only.empty() ? *systems().front() : *chosen_systems(only).front();
  const VariantConfig defaults = new_variant(&system);
  for (const VariantKey& key : system.keys())
    list.push_back({{"key", key.path},
                    {"default", key.default_text(defaults)},
                    {"unit", key.unit},
                    {"allowed", key.allowed_text()},
                    {"read_by", readers_of(system, key)},
                    {"meaning", key.meaning}});
  return list;
}

Json list_trajectories(const std::string& only) {
  Json list = Json::array();
  for (const System* system : chosen_systems(only))
    for (const MotionKind& motion : simulation_of(*system).motions())
      list.push_back(
          {{"system", system->name()}, {"kind", motion.kind}, {"keys", motion.keys}, {"summary", motion.summary}});
  return list;
}

struct Section {
  const char* name;
  Json (*list)(const std::string& system);
};
constexpr Section sections[] = {{"systems", list_systems},     {"variants", list_variants},
                                {"scenarios", list_scenarios}, {"solvers", list_solvers},
                                {"laws", list_laws},           {"estimators", list_estimators},
                                {"keys", list_keys},           {"parameters", list_parameters},
                                {"modes", list_modes},         {"trajectories", list_trajectories},
                                {"wires", list_wires}};

/// Any list of like objects as a table: keys are headings.
Table table_of(const Section& section, const std::string& system, bool titled) {
  const Json list = section.list(system);
  Table table{.name = section.name, .title = titled ? section.name + std::string(":") : ""};
  if (list.empty()) return table;
  for (const auto& [key, value] : list.at(0).items()) table.columns.push_back({key, key, value.is_number() ? "" : "<"});
  for (const Json& object : list) table.add({object.begin(), object.end()});
  return table;
}

}  // namespace

void add_list(CLI::App& app, int& exit_code) {
  struct ListArguments {
    std::string what, system;
    OutputOptions output;
  };
  auto options = std::make_shared<ListArguments>();
  CLI::App* command = app.add_subcommand("list", "what there is to choose from");
  std::vector<std::string> names;
  for (const Section& section : sections) names.emplace_back(section.name);
  command->add_option("what", options->what, "one kind of thing; default: all")->check(CLI::IsMember(names));
  command->add_option("--system", options->system, "of this system alone; keys: default the first of `list systems`");
  add_output_options(*command, options->output, {"table", "json", "markdown"});
  command->callback([options, &exit_code] {
    Result result;
    for (const Section& section : sections)
      if (options->what.empty() || options->what == section.name)
        result.tables.push_back(table_of(section, options->system, options->what.empty()));
    options->output.write(result);
    exit_code = success;
  });
}

}  // namespace solenoid
