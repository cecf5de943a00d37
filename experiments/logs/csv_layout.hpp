#pragma once

#include "experiments/logs/csv_reader.hpp"

#include <functional>

namespace solenoid {

/// A CSV before its rows.
struct CsvLayout {
  char delimiter = ',', decimal = '.';
  int heading_line = 1;
  std::vector<std::string> headings;
  std::vector<std::string> comments;  ///< lines before the heading that begin with #, without that
  std::string_view rows;              ///< behind the heading
  std::string told;                   ///< what is not as in a plain CSV, for a person; empty: nothing
};

/// How many of the headings that are looked for are among these.
using CountKnown = std::function<std::size_t(const std::vector<std::string>& headings)>;

/// Finds separator, decimal sign and heading of a CSV where `said` does not say them. The heading is the line, of the
/// first fifty, that has the most known headings under any separator; what is before it is passed over. Decimals are
/// commas if numbers of the first rows have commas and none has a point. Throws ConfigError with the file's name for
/// text that is none, UTF-16 for instance, and for a file without a line.
CsvLayout find_layout(std::string_view text, const std::string& name, const CsvDialect& said, const CountKnown& known);

}  // namespace solenoid
