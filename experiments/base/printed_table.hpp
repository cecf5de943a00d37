#pragma once

#include <string>
#include <vector>

namespace solenoid {

/// A number as the thesis prints it; "<0.01" keeps its value and that it is only a bound.
struct PrintedNumber {
  double value = 0.0;
  bool upper_bound = false;

  /// Throws std::invalid_argument for anything but a number, optionally after '<'.
  static PrintedNumber parse(const std::string& text);
};

/// One of the thesis's tables, as shipped inside the program: a heading line and rows of comma-separated cells.
class PrintedTable {
 public:
  /// `name` is the file's name below experiments/systems/actuator/data/tables, without ".csv". Throws std::invalid_argument if there is
  /// none.
  static PrintedTable shipped(const std::string& name);
  /// Throws std::invalid_argument if a row has not as many cells as the heading.
  static PrintedTable parse(const std::string& csv, const std::string& name);

  std::size_t rows() const { return rows_.size(); }
  bool has_column(const std::string& column) const;
  const std::string& text(std::size_t row, const std::string& column) const;
  PrintedNumber number(std::size_t row, const std::string& column) const;

 private:
  std::string name_;
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace solenoid
