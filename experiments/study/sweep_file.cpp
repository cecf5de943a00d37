#include "core/config/reader.hpp"
#include "experiments/base/printed_table.hpp"
#include "experiments/campaign/library.hpp"
#include "experiments/campaign/variant_numbers.hpp"
#include "experiments/study/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

std::vector<std::string> figure_names(const SystemDescription& system) {
  std::vector<std::string> names;
  for (const StudyFigure& figure : study_figures(system)) names.push_back(figure.name);
  return names;
}

Sweep read_sweep(TableReader& table, const Campaign& campaign) {
  Sweep sweep;
  sweep.key = table.text("key");
  sweep.label = table.text_or("label", sweep.key);
  sweep.values = table.numbers("values");
  sweep.drawn = table.has("drawn") ? table.numbers("drawn") : sweep.values;
  if (sweep.values.empty()) table.fail("values", "empty (allowed: at least one number)");
  if (sweep.drawn.size() != sweep.values.size())
    table.fail("drawn", fmt::format("has {} numbers (allowed: one for each of the {} values)", sweep.drawn.size(),
                                    sweep.values.size()));
  for (const VariantConfig& variant : campaign.variants) sweep.variants.push_back(variant.name);
  if (table.has("variants")) {
    const std::vector<std::string> all = std::exchange(sweep.variants, table.texts("variants"));
    for (const std::string& name : sweep.variants)
      if (!std::ranges::count(all, name))
        table.fail("variants", fmt::format("'{}' is not one of the campaign's variants", name));
  }
  table.finish();
  return sweep;
}

PrintedSeries read_printed(TableReader table, std::size_t figures) {
  PrintedSeries printed{table.text("name"), table.text("file"), table.text("value"), table.texts("columns")};
  if (printed.columns.size() != figures)
    table.fail("columns", fmt::format("{} of them (allowed: one for each of the table's {} figures)",
                                      printed.columns.size(), figures));
  try {
    const PrintedTable shipped = PrintedTable::shipped(printed.file);
    for (const std::string& column : printed.columns) shipped.number(0, column);
  } catch (const std::exception& error) {
    table.fail("file", fmt::format("{} (allowed: a table of the thesis and its columns)", error.what()));
  }
  table.finish();
  return printed;
}

bool any_begins_with(const ScenarioList& scenarios, const std::string& prefix) {
  for (std::size_t i = 0; i < scenarios.size(); ++i)
    if (scenarios.name(i).starts_with(prefix)) return true;
  return false;
}

void check_scenarios(const TableReader& table, const StudyTable& t, const Campaign& campaign) {
  for (const std::string& prefix : t.scenarios)
    if (!any_begins_with(campaign.scenarios, prefix))
      table.fail("scenarios", fmt::format("no scenario's name begins with '{}'", prefix));
}

StudyTable read_table(TableReader& table, const Campaign& campaign, const Sweep& sweep) {
  StudyTable t;
  t.name = table.text("name");
  t.title = table.text_or("title", t.name);
  t.scenarios = table.texts("scenarios");
  check_scenarios(table, t, campaign);
  t.figures = table.texts("figures");
  for (const std::string& name : t.figures)
    if (const auto known = figure_names(campaign.system->description()); !std::ranges::count(known, name))
      table.fail("figures", fmt::format("'{}' is not known (allowed: {})", name, fmt::join(known, ", ")));
  t.across_conditions = table.boolean_or("across_conditions", false);
  if (t.across_conditions && campaign.system->description().conditions.empty())
    table.fail("across_conditions", fmt::format("scenarios of {} have none (allowed: false)", campaign.system->name()));
  if (table.has("only")) {
    t.only = table.number("only");
    if (!std::ranges::count(sweep.values, *t.only)) table.fail("only", "not one of the sweep's values");
  }
  if (table.has("knee")) {
    TableReader knee = table.table("knee");
    t.knee = KneeOf{knee.text("x", t.figures), knee.text("y", t.figures), {}};
    if (knee.has("among")) t.knee->among = knee.numbers("among");
    knee.finish();
  }
  if (table.has("at")) {
    TableReader at = table.table("at");
    t.at = ReadAt{at.text("x", t.figures), at.text("y", t.figures), at.numbers("values", Range::positive())};
    at.finish();
  }
  if (table.has("fronts")) {
    TableReader fronts = table.table("fronts");
    t.fronts = FrontOf{fronts.texts("x"), fronts.text("y", t.figures)};
    for (const std::string& x : t.fronts->x)
      if (!std::ranges::count(t.figures, x))
        fronts.fail("x", fmt::format("'{}' is not a figure of the table (allowed: {})", x, fmt::join(t.figures, ", ")));
    fronts.finish();
  }
  if (table.has("printed")) t.printed = read_printed(table.table("printed"), t.figures.size());
  table.finish();
  return t;
}

StudyPanel read_panel(TableReader& table, const std::vector<StudyTable>& tables) {
  StudyPanel panel;
  std::vector<std::string> names(tables.size());
  std::ranges::transform(tables, names.begin(), &StudyTable::name);
  panel.table = table.text("table", names);
  std::vector<std::string> figures = std::ranges::find(tables, panel.table, &StudyTable::name)->figures;
  panel.y = table.text("y", figures);
  figures.push_back("value");
  panel.x = table.text_or("x", "value", figures);
  panel.log = table.text_or("log", "", {"", "x", "y", "xy"});
  table.finish();
  return panel;
}

/// The campaign with a variant for each value in place of those swept.
void cross(Study& study, const Campaign& base, const std::string& where) {
  Document document = *base.resolved;
  toml::table& variants = *document.root()["variant"].as_table();
  toml::array names;
  const auto is_whole = [](double v) { return v == std::round(v); };
  const bool whole = std::ranges::all_of(study.sweep.values, is_whole);
  for (const VariantConfig& variant : base.variants) {
    if (!std::ranges::count(study.sweep.variants, variant.name)) {
      names.push_back(variant.name);
      study.members.push_back({variant.name, std::nullopt});
      continue;
    }
    for (const double value : study.sweep.values) {
      const std::string name = fmt::format("{}-{}", variant.name, value);
      variants.insert_or_assign(name, *base.resolved->root()["variant"][variant.name].as_table());
      document.comes_from("variant." + name, *base.resolved, "variant." + variant.name);
      set_number(document, name, study.sweep.key, value, whole, where);
      names.push_back(name);
      study.members.push_back({variant.name, value});
    }
  }
  document.root().insert_or_assign("variants", names);
  document.root().insert_or_assign("name", "study-" + base.name);
  study.campaign = read_campaign(std::move(document));
}

}  // namespace

Study read_study(const std::string& path) {
  Library library;
  library.load(path);
  const Campaign base = read_campaign(library);
  TableReader& root = library.root();
  if (!root.has("study")) root.fail("study", "missing (allowed: a table [study], docs/how-to/studies.md)");
  TableReader reader = root.table("study");
  Study study;
  study.name = base.name;
  study.title = reader.text_or("title", base.name);
  TableReader sweep = reader.table("sweep");
  study.sweep = read_sweep(sweep, base);
  for (TableReader& table : reader.tables("table")) study.tables.push_back(read_table(table, base, study.sweep));
  if (study.tables.empty()) reader.fail("table", "missing (allowed: at least one table headed [[study.table]])");
  for (TableReader& panel : reader.tables("panel")) study.panels.push_back(read_panel(panel, study.tables));
  reader.finish();
  try {
    cross(study, base, sweep.where("values"));
  } catch (const ConfigError& error) {
    reader.fail("sweep", fmt::format("a value of '{}' is refused: {}", study.sweep.key, error.what()));
  }
  return study;
}

}  // namespace solenoid
