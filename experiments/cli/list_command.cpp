#include "controllers/catalogue.hpp"
#include "controllers/variant_keys.hpp"
#include "core/actuator/dynamics.hpp"
#include "core/actuator/valves.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/text_table.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/cli/commands.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

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

std::string cell(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number_float()) return short_number(value.get<double>());
  if (value.is_array()) return fmt::format("{}", fmt::join(value.get<std::vector<std::string>>(), "; "));
  return value.dump();
}

/// Any list of like objects as a table: keys are headings.
std::string table_of(const Json& list) {
  std::vector<TextTable::Column> columns;
  for (const auto& [key, value] : list.at(0).items())
    columns.push_back({key, value.is_number() ? TextTable::Align::right : TextTable::Align::left});
  TextTable table(columns);
  for (const Json& object : list) {
    std::vector<std::string> cells;
    for (const auto& [key, value] : object.items()) cells.push_back(cell(value));
    table.add_row(cells);
  }
  return table.text(false);
}

/// The same as a table of a Markdown page.
std::string markdown_of(const Json& list) {
  std::string head, rule, rows;
  for (const auto& [key, value] : list.at(0).items()) head += "| " + key + " ", rule += "|---";
  for (const Json& object : list) {
    bool first = true;  // the name of the thing, as code
    for (const auto& [key, value] : object.items()) {
      rows += first ? fmt::format("| `{}` ", cell(value)) : fmt::format("| {} ", cell(value));
      first = false;
    }
    rows += "|\n";
  }
  return head + "|\n" + rule + "|\n" + rows;
}

std::string listing(const std::string& what, const std::string& format) {
  Json all = Json::object();
  std::string text;
  for (const Section& section : sections) {
    if (!what.empty() && what != section.name) continue;
    const Json list = section.list();
    all[section.name] = list;
    if (what.empty()) text += fmt::format("{}{}:\n", text.empty() ? "" : "\n", section.name);
    text += format == "markdown" ? markdown_of(list) : table_of(list);
  }
  return format == "json" ? all.dump(1) + "\n" : text;
}

}  // namespace

void add_list(CLI::App& app, int& exit_code) {
  struct Options {
    std::string what, format = "table";
  };
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("list", "what there is to choose from");
  std::vector<std::string> names;
  for (const Section& section : sections) names.emplace_back(section.name);
  command->add_option("what", options->what, "one kind of thing; default: all")->check(CLI::IsMember(names));
  command->add_option("--format", options->format, "table, json or markdown")
      ->check(CLI::IsMember({"table", "json", "markdown"}));
  command->callback([options, &exit_code] {
    write_standard_output(listing(options->what, options->format));
    exit_code = success;
  });
}

}  // namespace solenoid
