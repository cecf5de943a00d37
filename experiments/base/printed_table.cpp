#include "experiments/base/printed_table.hpp"

#include "experiments/base/embedded.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

std::vector<std::string> cells_of(std::string line) {
  if (line.ends_with('\r')) line.pop_back();
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',')
      cells.emplace_back();
    else
      cells.back() += c;
  }
  return cells;
}

}  // namespace

PrintedNumber PrintedNumber::parse(const std::string& text) {
  PrintedNumber number;
  number.upper_bound = text.starts_with('<');
  const std::string digits = text.substr(number.upper_bound ? 1 : 0);
  std::size_t used = 0;
  try {
    number.value = std::stod(digits, &used);
  } catch (const std::logic_error&) {
    used = 0;
  }
  if (used == 0 || used != digits.size() || !std::isfinite(number.value))
    throw std::invalid_argument(fmt::format("'{}' is not a printed number", text));
  return number;
}

PrintedTable PrintedTable::shipped(const std::string& name) {
  const std::string_view csv = embedded_text("tables/" + name + ".csv");
  if (csv.empty()) throw std::invalid_argument(fmt::format("the thesis has no table '{}' here", name));
  return parse(std::string(csv), name);
}

PrintedTable PrintedTable::parse(const std::string& csv, const std::string& name) {
  PrintedTable table;
  table.name_ = name;
  std::istringstream in(csv);
  std::string line;
  while (std::getline(in, line)) {
    if (line.empty()) continue;
    std::vector<std::string> cells = cells_of(line);
    if (table.columns_.empty()) {
      table.columns_ = std::move(cells);
      continue;
    }
    if (cells.size() != table.columns_.size())
      throw std::invalid_argument(fmt::format("{}: row '{}' has not {} cells", name, line, table.columns_.size()));
    table.rows_.push_back(std::move(cells));
  }
  return table;
}

bool PrintedTable::has_column(const std::string& column) const {
  return std::find(columns_.begin(), columns_.end(), column) != columns_.end();
}

const std::string& PrintedTable::text(std::size_t row, const std::string& column) const {
  const auto found = std::find(columns_.begin(), columns_.end(), column);
  if (found == columns_.end()) throw std::invalid_argument(fmt::format("{} has no column '{}'", name_, column));
  return rows_.at(row)[static_cast<std::size_t>(found - columns_.begin())];
}

PrintedNumber PrintedTable::number(std::size_t row, const std::string& column) const {
  return PrintedNumber::parse(text(row, column));
}

}  // namespace solenoid
