#include "experiments/base/text_table.hpp"
#include "experiments/study/sweep.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

Json number(std::optional<double> value) { return value && std::isfinite(*value) ? Json(*value) : Json(nullptr); }

std::string value_heading(const Study& study, const StudyTable& table) {
  return table.across_payloads ? "payload kg" : study.sweep.key;
}

TextTable::Cell text_of(std::optional<double> value) {
  return {value && std::isfinite(*value) ? short_number(*value) : std::string("-")};
}

std::string table_text(const Study& study, const StudyTable& table, const StudyRows& rows, bool colour) {
  std::vector<TextTable::Column> columns = {{"variant", TextTable::Align::left}, {value_heading(study, table)}};
  for (const std::string& figure : table.figures) columns.push_back({figure});
  if (table.knee) columns.push_back({"to best"});
  columns.push_back({"bad runs"});
  TextTable text(columns);
  for (const StudyPoint& p : rows) {
    std::vector<TextTable::Cell> cells = {{p.series}, {p.value ? fmt::format("{}", *p.value) : std::string("-")}};
    for (const double figure : p.figures) cells.push_back(text_of(figure));
    if (table.knee) cells.push_back({text_of(p.to_best).text, p.knee});
    cells.push_back({fmt::format("{} of {}", p.bad, p.runs)});
    text.add_row(std::move(cells));
  }
  return table.title + "\n\n" + text.text(colour);
}

/// A line for each series' knee.
std::string knees_text(const Study& study, const StudyTable& table, const StudyRows& rows) {
  if (!table.knee) return "";
  std::string text;
  for (const StudyPoint& p : rows)
    if (p.knee)
      text +=
          fmt::format("Knee of {} against {}, {}: {} = {}, {:.3f} from the best in both{}.\n", table.knee->y,
                      table.knee->x, p.series, study.sweep.key, *p.value, *p.to_best,
                      table.knee->among.empty() ? "" : fmt::format(", among {}", fmt::join(table.knee->among, " ")));
  return text;
}

}  // namespace

std::string study_text(const Study& study, std::span<const StudyRows> rows, bool colour) {
  std::string text = study.title + "\n";
  for (std::size_t t = 0; t < rows.size(); ++t)
    text += "\n" + table_text(study, study.tables[t], rows[t], colour) + knees_text(study, study.tables[t], rows[t]);
  return text;
}

std::string study_json(const Study& study, std::span<const StudyRows> rows) {
  Json json = {{"study", study.name}, {"title", study.title}, {"key", study.sweep.key}, {"tables", Json::array()}};
  for (std::size_t t = 0; t < rows.size(); ++t) {
    const StudyTable& table = study.tables[t];
    Json one = {{"name", table.name}, {"title", table.title}, {"rows", Json::array()}};
    for (const StudyPoint& p : rows[t]) {
      Json row = {{"variant", p.series}, {"value", number(p.value)}, {"runs", p.runs}, {"bad", p.bad}};
      for (std::size_t i = 0; i < table.figures.size(); ++i) row[table.figures[i]] = number(p.figures[i]);
      if (table.knee) row["to_best"] = number(p.to_best), row["knee"] = p.knee;
      one["rows"].push_back(std::move(row));
    }
    json["tables"].push_back(std::move(one));
  }
  return json.dump(1) + "\n";
}

std::string study_csv(const Study& study, std::span<const StudyRows> rows) {
  std::string text = "table,variant,value,runs,bad,figure,number\n";
  for (std::size_t t = 0; t < rows.size(); ++t)
    for (const StudyPoint& p : rows[t])
      for (std::size_t i = 0; i < p.figures.size(); ++i)
        text += fmt::format("{},\"{}\",{},{},{},{},{}\n", study.tables[t].name, p.series,
                            p.value ? fmt::format("{}", *p.value) : "", p.runs, p.bad, study.tables[t].figures[i],
                            std::isfinite(p.figures[i]) ? fmt::format("{}", p.figures[i]) : "");
  return text;
}

}  // namespace solenoid
