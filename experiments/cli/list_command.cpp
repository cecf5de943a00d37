#include "controllers/catalogue.hpp"
#include "controllers/variant_keys.hpp"
#include "core/systems/actuator/dynamics.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"

#include <CLI/CLI.hpp>

namespace solenoid {
namespace {

Json list_variants() {
  Json list = Json::array();
  for (const VariantConfig& v : shipped_variants())
    list.push_back({{"name", v.name},
                    {"hybrid", v.hybrid()},
                    {"valves", v.valves},
                    {"solver", v.solver},
                    {"estimator", v.estimator},
                    {"summary", v.summary}});
  return list;
}

Json list_scenarios() {
  Json list = Json::array();
  for (const std::string& name : shipped_campaigns())
    for (const ScenarioConfig& s : read_campaign(name).scenarios)
      list.push_back({{"campaign", name},
                      {"name", s.name},
                      {"trajectory", s.trajectory_kind},
                      {"plane", s.plane == Plane::vertical ? "vertical" : "horizontal"},
                      {"payload_kg", s.payload_kg},
                      {"plant", s.plant},
                      {"noise", s.noise},
                      {"duration_s", s.duration_s}});
  return list;
}

Json list_parameters() {
  Json list = Json::array();
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

Json list_valves() {
  Json list = Json::array();
  for (const std::string& name : valve_configurations()) {
    const ModeSet modes = valve_modes(name, {});
    std::vector<std::string> coils, states;
    for (const Switch& coil : modes.switches()) coils.push_back(coil.name);
    for (const Mode& mode : modes.modes()) states.push_back(mode.name);
    list.push_back({{"name", name}, {"modes", modes.size()}, {"coils", coils}, {"states", states}});
  }
  return list;
}

Json list_solvers() {
  Json list = Json::array();
  for (const SolverRow& row : solver_rows())
    list.push_back({{"name", row.name},
                    {"real_time", row.real_time},
                    {"joint_motor", row.chooses_continuous},
                    {"pulses", row.pulses},
                    {"valves", row.valves.empty() ? valve_configurations() : row.valves},
                    {"summary", row.summary}});
  return list;
}

Json list_laws() {
  Json list = Json::array();
  for (const LawRow& row : law_rows())
    list.push_back({{"name", row.name}, {"tables", row.groups}, {"valves", row.valves}, {"summary", row.summary}});
  return list;
}

Json list_estimators() {
  Json list = Json::array();
  for (const EstimatorRow& row : estimator_rows())
    list.push_back({{"name", row.name}, {"finds_load", row.finds_load}, {"summary", row.summary}});
  return list;
}

Json list_keys() {
  Json list = Json::array();
  for (const VariantKey& key : variant_keys())
    list.push_back({{"key", key.path},
                    {"default", key.default_text()},
                    {"unit", key.unit},
                    {"allowed", key.allowed_text()},
                    {"read_by", readers_of(key)},
                    {"meaning", key.meaning}});
  return list;
}

Json list_trajectories() {
  const auto entry = [](const char* kind, const char* keys, const char* summary) {
    return Json{{"kind", kind}, {"keys", keys}, {"summary", summary}};
  };
  return Json::array(
      {entry("cycloidal", "from_m, to_m, move_s, dwell_s", "dwell, one cycloid, dwell"),
       entry("sine", "from_m, to_m, frequency_hz, periods, lead_s",
             "a cycloid up, periods of a cosine, a cycloid back"),
       entry("step", "from_m, height_m, at_s, hold_s, steady_s", "a step, held"),
       entry("multi_cycloid", "from_m, to_m = [..], move_s, dwell_s", "cycloids from station to station, with dwells"),
       entry("csv", "path", "points time_s,position_m of a file")});
}

struct Section {
  const char* name;
  Json (*list)();
};
constexpr Section sections[] = {{"variants", list_variants},        {"scenarios", list_scenarios},
                                {"solvers", list_solvers},          {"laws", list_laws},
                                {"estimators", list_estimators},    {"keys", list_keys},
                                {"parameters", list_parameters},    {"valves", list_valves},
                                {"trajectories", list_trajectories}};

/// Any list of like objects as a table: keys are headings.
Table table_of(const Section& section, bool titled) {
  const Json list = section.list();
  Table table{.name = section.name, .title = titled ? section.name + std::string(":") : ""};
  for (const auto& [key, value] : list.at(0).items()) table.columns.push_back({key, key, value.is_number() ? "" : "<"});
  for (const Json& object : list) table.add({object.begin(), object.end()});
  return table;
}

}  // namespace

void add_list(CLI::App& app, int& exit_code) {
  struct ListArguments {
    std::string what;
    OutputOptions output;
  };
  auto options = std::make_shared<ListArguments>();
  CLI::App* command = app.add_subcommand("list", "what there is to choose from");
  std::vector<std::string> names;
  for (const Section& section : sections) names.emplace_back(section.name);
  command->add_option("what", options->what, "one kind of thing; default: all")->check(CLI::IsMember(names));
  add_output_options(*command, options->output, {"table", "json", "markdown"});
  command->callback([options, &exit_code] {
    Result result;
    for (const Section& section : sections)
      if (options->what.empty() || options->what == section.name)
        result.tables.push_back(table_of(section, options->what.empty()));
    options->output.write(result);
    exit_code = success;
  });
}

}  // namespace solenoid
