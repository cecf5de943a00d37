#pragma once

#include <string>
#include <vector>

namespace solenoid {

/// Whether standard output is a terminal that wants colour (NO_COLOR unset).
bool colour_wanted();

/// A table of aligned columns for a terminal. A marked cell reads `value*`, and is bold where colour is wanted.
class TextTable {
 public:
  enum class Align { left, right };
  struct Column {
    std::string heading;
    Align align = Align::right;
  };
  struct Cell {
    std::string text;
    bool marked = false;
  };

  explicit TextTable(std::vector<Column> columns) : columns_(std::move(columns)) {}
  void add_row(std::vector<Cell> cells) { rows_.push_back(std::move(cells)); }
  void add_row(const std::vector<std::string>& texts);
  std::string text(bool colour) const;

 private:
  std::vector<Column> columns_;
  std::vector<std::vector<Cell>> rows_;
};

/// A number for a person: three significant digits, no exponent between 0.001 and a million.
std::string short_number(double value);

}  // namespace solenoid
