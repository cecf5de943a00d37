#include "experiments/logs/csv_reader.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <new>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::size_t longest_cell = 65536, most_cells = 4096;

struct NamedCharacter {
  const char* name;
  char character;
};
constexpr std::array delimiters = {NamedCharacter{"comma", ','}, NamedCharacter{"semicolon", ';'},
                                   NamedCharacter{"tab", '\t'}, NamedCharacter{"bar", '|'}};
constexpr std::array decimals = {NamedCharacter{"point", '.'}, NamedCharacter{"comma", ','}};

char character_of(const char* option, const std::string& text, const auto& known) {
  for (const NamedCharacter& one : known)
    if (text == one.name || text == std::string(1, one.character)) return one.character;
  std::string allowed;
  for (const NamedCharacter& one : known) allowed += fmt::format("{}{}", allowed.empty() ? "" : ", ", one.name);
  throw ConfigError(fmt::format("{}: '{}' (allowed: {})", option, text, allowed));
}

int only_spaces(unsigned char c) { return c == ' ' ? 1 : 0; }

void begin_parser(csv_parser& parser, char delimiter) {
  if (csv_init(&parser, CSV_STRICT) != 0) throw std::bad_alloc();
  csv_set_delim(&parser, static_cast<unsigned char>(delimiter));
  if (delimiter == '\t') csv_set_space_func(&parser, only_spaces);  // a tab is no space around a cell there
}

void trim(std::string& cell) {
  constexpr const char* spaces = " \t\r\n";
  cell.erase(cell.find_last_not_of(spaces) + 1);
  cell.erase(0, cell.find_first_not_of(spaces));
}

}  // namespace

char delimiter_of(const std::string& text) { return character_of("--delimiter", text, delimiters); }
char decimal_of(const std::string& text) { return character_of("--decimal", text, decimals); }

CsvRows::CsvRows(std::string_view text, std::string name, char delimiter, int first_line)
    : rest_(text), name_(std::move(name)), line_(first_line - 1), row_line_(first_line) {
  begin_parser(parser_, delimiter);
}

CsvRows::~CsvRows() { csv_free(&parser_); }

void CsvRows::fail(const std::string& problem) const {
  throw ConfigError(fmt::format("{}:{}: {}", name_, row_line_, problem));
}

// libcsv is C: nothing may be thrown through it, so rows of too many cells are noticed behind it.
void CsvRows::take_cell(void* cell, std::size_t size, void* self) {
  auto& rows = *static_cast<CsvRows*>(self);
  if (rows.count_ == rows.cells_.size() && rows.count_ <= most_cells) rows.cells_.emplace_back();
  if (rows.count_ < rows.cells_.size()) rows.cells_[rows.count_].assign(static_cast<const char*>(cell), size);
  ++rows.count_;
}

void CsvRows::take_row(int, void* self) { static_cast<CsvRows*>(self)->done_ = true; }

void CsvRows::feed(std::string_view line) {
  while (!line.empty()) {
    const std::string_view piece = line.substr(0, longest_cell);
    line.remove_prefix(piece.size());
    if (csv_parse(&parser_, piece.data(), piece.size(), take_cell, take_row, this) != piece.size())
      fail("a quote in the middle of a cell (allowed: quotes around a whole cell, doubled within)");
    if (csv_get_buffer_size(&parser_) > longest_cell)
      fail(fmt::format("a cell of more than {} bytes: a quote that is not closed? (allowed: less)", longest_cell));
  }
}

bool CsvRows::next() {
  count_ = 0;
  done_ = false;
  while (!done_ && !rest_.empty()) {
    const std::string_view line = take_line(rest_);
    ++line_;
    if (!inside_ && line.starts_with('#')) continue;
    if (!inside_) row_line_ = line_;
    feed(line);
    inside_ = !done_ && line.find_first_not_of(" \t\r\n") != std::string_view::npos;
    cut_ = rest_.empty() && !line.ends_with('\n') && !line.ends_with('\r');
  }
  if (!done_) csv_fini(&parser_, take_cell, take_row, this);
  if (!done_) return false;
  inside_ = false;
  if (count_ > most_cells) fail(fmt::format("{} cells (allowed: at most {})", count_, most_cells));
  cells_.resize(count_);
  for (std::string& cell : cells_) trim(cell);
  return true;
}

std::string_view take_line(std::string_view& text) {
  std::size_t end = text.find_first_of("\r\n");
  if (end == std::string_view::npos)
    end = text.size();
  else
    end += text.substr(end).starts_with("\r\n") ? 2 : 1;
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end);
  return line;
}

std::vector<std::string> cells_of_line(std::string_view line, char delimiter) {
  try {
    CsvRows rows(line, "", delimiter, 1);
    return rows.next() ? rows.cells() : std::vector<std::string>();
  } catch (const ConfigError&) {
    return {};
  }
}

std::optional<double> number_of_cell(std::string_view cell, char decimal) {
  std::string with_point(cell);
  if (decimal == ',') {
    if (with_point.find('.') != std::string::npos) return std::nullopt;
    std::ranges::replace(with_point, ',', '.');
  }
  std::string_view text = with_point;
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end.ec != std::errc() || end.ptr != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace solenoid
