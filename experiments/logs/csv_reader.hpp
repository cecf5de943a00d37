#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <csv.h>

namespace solenoid {

/// How a CSV is written; what is not said is found out.
struct CsvDialect {
  std::optional<char> delimiter;  ///< between cells: , ; tab |
  std::optional<char> decimal;    ///< . or ,
  std::optional<int> skip_lines;  ///< before the heading
};

/// "comma", ",", "tab" ... Throws ConfigError for another.
char delimiter_of(const std::string& text);
/// "point", ",", ... Throws ConfigError for another.
char decimal_of(const std::string& text);

/// The rows of a CSV as RFC 4180 has them, read one after the other: quoted cells may hold separators, quotes and line
/// ends; spaces around cells do not count; lines may end as anywhere. Lines that begin with # and empty ones are left
/// out. Throws ConfigError with file and line for quotes that are not closed, or closed in the middle of a cell.
///
/// Tokens are libcsv's.
class CsvRows {
 public:
  CsvRows(std::string_view text, std::string name, char delimiter, int first_line);
  ~CsvRows();
  CsvRows(const CsvRows&) = delete;
  CsvRows& operator=(const CsvRows&) = delete;

  /// Reads another row; false at the end.
  bool next();
  const std::vector<std::string>& cells() const { return cells_; }
  int line() const { return row_line_; }  ///< where the row begins
  bool cut() const { return cut_; }       ///< the row is the last, and its line does not end
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  static void take_cell(void* cell, std::size_t size, void* self);
  static void take_row(int end, void* self);
  void feed(std::string_view line);

  std::string_view rest_;
  std::string name_;
  csv_parser parser_{};
  std::vector<std::string> cells_;
  std::size_t count_ = 0;  // of cells in the row so far
  int line_ = 0, row_line_ = 0;
  bool done_ = false, inside_ = false, cut_ = false;
};

/// Takes a line off the front of a text, with its end: \n, \r\n or \r.
std::string_view take_line(std::string_view& text);
/// The cells of one line, without spaces around them; none where its quotes are wrong.
std::vector<std::string> cells_of_line(std::string_view line, char delimiter);

/// A number of a cell; nothing if it is none. With a decimal comma, points do not count as digits of anything.
std::optional<double> number_of_cell(std::string_view cell, char decimal);

}  // namespace solenoid
