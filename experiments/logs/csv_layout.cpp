#include "experiments/logs/csv_layout.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr int most_lines_before = 50, looked_at_rows = 200;
constexpr std::size_t longest_heading = 65536;
constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";

void require_text(std::string_view text, const std::string& name) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
    throw ConfigError(fmt::format("{}: is UTF-16 (allowed: UTF-8)", name));
  if (text.substr(0, 4096).find('\0') != std::string_view::npos)
    throw ConfigError(fmt::format("{}: no text (allowed: a CSV)", name));
}

/// A line that may be the heading.
struct Candidate {
  std::size_t known = 0;
  CsvLayout layout;
};

Candidate under_best_delimiter(std::string_view line, const CsvDialect& said, const CountKnown& known) {
  constexpr std::array usual = {',', ';', '\t', '|'};
  Candidate best;
  line = line.substr(0, longest_heading);
  for (const char delimiter : usual) {
    if (said.delimiter && *said.delimiter != delimiter) continue;
    std::vector<std::string> cells = cells_of_line(line, delimiter);
    const std::size_t count = known(cells);
    const bool better = count > best.known || (count == best.known && cells.size() > best.layout.headings.size());
    if (!better) continue;
    best.known = count;
    best.layout.delimiter = delimiter;
    best.layout.headings = std::move(cells);
  }
  return best;
}

char decimal_in(const CsvLayout& layout, const std::string& name) {
  CsvRows rows(layout.rows, name, layout.delimiter, layout.heading_line + 1);
  bool comma = false;
  for (int i = 0; i < looked_at_rows && rows.next(); ++i)
    for (const std::string& cell : rows.cells()) {
      if (cell.find('.') != std::string::npos && number_of_cell(cell, '.')) return '.';
      comma = comma || (cell.find(',') != std::string::npos && number_of_cell(cell, ','));
    }
  return comma ? ',' : '.';
}

std::string what_is_told(const CsvLayout& layout, const CsvDialect& said, int passed_over) {
  std::vector<std::string> parts;
  if (layout.delimiter != ',' && !said.delimiter)
    parts.emplace_back(layout.delimiter == ';'    ? "semicolons between cells"
                       : layout.delimiter == '\t' ? "tabs between cells"
                                                  : "bars between cells");
  if (layout.decimal == ',' && !said.decimal) parts.emplace_back("decimal commas");
  if (passed_over > 0 && !said.skip_lines)
    parts.push_back(fmt::format("the heading in line {}, {} before it passed over", layout.heading_line,
                                passed_over == 1 ? "a line" : fmt::format("{} lines", passed_over)));
  if (parts.empty()) return {};
  return fmt::format("read with {} (otherwise: --delimiter, --decimal, --skip-lines)", fmt::join(parts, ", "));
}

}  // namespace

CsvLayout find_layout(std::string_view text, const std::string& name, const CsvDialect& said, const CountKnown& known) {
  require_text(text, name);
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  Candidate best;
  int passed_over = 0, passed_over_best = 0;
  std::vector<std::string> comments;
  for (int line = 1; line <= most_lines_before + said.skip_lines.value_or(0) && !text.empty(); ++line) {
    const std::string_view here = take_line(text);
    if (line <= said.skip_lines.value_or(0)) continue;
    if (here.starts_with('#') && !said.skip_lines) {
      const std::size_t end = here.find_last_not_of("\r\n");
      if (here.size() <= longest_heading)
        comments.emplace_back(here.substr(1, end == std::string_view::npos ? 0 : end));
      continue;
    }
    if (here.find_first_not_of(" \t\r\n") == std::string_view::npos) continue;
    Candidate candidate = under_best_delimiter(here, said, known);
    if (candidate.known > best.known || best.layout.headings.empty()) {
      best = std::move(candidate);
      best.layout.heading_line = line;
      best.layout.rows = text;
      best.layout.comments = comments;
      passed_over_best = passed_over;
    }
    ++passed_over;
    if (said.skip_lines) break;
  }
  if (best.layout.headings.empty()) throw ConfigError(fmt::format("{}: no heading (allowed: a CSV)", name));
  best.layout.decimal = said.decimal ? *said.decimal : decimal_in(best.layout, name);
  best.layout.told = what_is_told(best.layout, said, passed_over_best);
  return std::move(best.layout);
}

}  // namespace solenoid
