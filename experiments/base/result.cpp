#include "experiments/base/result.hpp"

#include <fmt/format.h>

namespace solenoid {
namespace {

/// The tables of a name as one: columns side by side.
Table whole(const std::vector<Table>& tables, const std::string& name) {
  Table wide;
  for (const Table& table : tables) {
    if (table.name != name) continue;
    wide.columns.insert(wide.columns.end(), table.columns.begin(), table.columns.end());
    wide.rows.resize(table.rows.size());
    for (std::size_t r = 0; r < table.rows.size(); ++r)
      wide.rows[r].insert(wide.rows[r].end(), table.rows[r].begin(), table.rows[r].end());
  }
  return wide;
}

}  // namespace

std::string Result::text(bool colour) const {
  std::string text;
  const auto block = [&](const std::string& lines) {
    if (!lines.empty()) text += (text.empty() ? "" : "\n") + lines;
  };
  if (!title.empty()) block(title + "\n");
  for (const Table& table : tables)
    if (table.shown() || !table.notes.empty()) block(table.text(colour));
  std::string last;
  for (const std::string& note : notes) last += note + "\n";
  block(last);
  return text;
}

std::string Result::json() const {
  Json all = facts;
  for (const Table& table : tables)
    if (!table.name.empty() && !all.contains(table.name)) all[table.name] = whole(tables, table.name).json();
  return all.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string Result::csv() const {
  return flat ? flat->csv() : tables.empty() ? "" : whole(tables, tables.front().name).csv();
}

std::string Result::markdown() const {
  std::string text;
  for (const Table& table : tables)
    if (table.shown()) text += (text.empty() ? "" : "\n") + table.markdown();
  return text;
}

std::string Result::html(const std::string& svg) const {
  std::string body = "<h1>" + html_escaped(title) + "</h1>\n";
  for (const Table& table : tables) body += table.html();
  for (const std::string& note : notes) body += "<p>" + html_escaped(note) + "</p>\n";
  return fmt::format(
      R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{}</title>
<style>
body {{ font: 15px/1.5 system-ui, sans-serif; margin: 2em; }}
h1 {{ font-size: 1.3em; }} h2 {{ font-size: 1.05em; }}
table {{ border-collapse: collapse; }} th, td {{ padding: 0.2em 0.8em; text-align: right; }}
tr {{ border-bottom: 1px solid #dddddd; }} .left {{ text-align: left; }}
svg {{ max-width: 100%; height: auto; }}
</style></head><body>
{}{}</body></html>
)",
      html_escaped(title), body, svg.substr(std::min(svg.size(), svg.find("<svg"))));
}

}  // namespace solenoid
