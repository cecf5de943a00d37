#include "experiments/base/text_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>
#include <unistd.h>

namespace solenoid {
namespace {

std::string padded(const std::string& text, std::size_t width, TextTable::Align align) {
  return align == TextTable::Align::left ? fmt::format("{:<{}}", text, width) : fmt::format("{:>{}}", text, width);
}

void end_line(std::string& text) {
  text.erase(text.find_last_not_of(' ') + 1);
  text += '\n';
}

}  // namespace

bool colour_wanted() { return ::isatty(STDOUT_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr; }

void TextTable::add_row(const std::vector<std::string>& texts) {
  std::vector<Cell> cells;
  for (const std::string& text : texts) cells.push_back({text});
  add_row(std::move(cells));
}

std::string TextTable::text(bool colour) const {
  // A column with marks keeps one place for them, so that numbers stay under numbers.
  std::vector<std::size_t> width;
  std::vector<bool> marks;
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    std::size_t widest = columns_[c].heading.size();
    bool marked = false;
    for (const auto& row : rows_) {
      widest = std::max(widest, row[c].text.size());
      marked = marked || row[c].marked;
    }
    width.push_back(widest);
    marks.push_back(marked);
  }
  std::string text;
  for (std::size_t c = 0; c < columns_.size(); ++c)
    text += padded(columns_[c].heading, width[c], columns_[c].align) + (marks[c] ? "   " : "  ");
  end_line(text);
  for (const auto& row : rows_) {
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      std::string cell = padded(row[c].text, width[c], columns_[c].align);
      if (marks[c]) cell += row[c].marked ? '*' : ' ';
      text += colour && row[c].marked ? fmt::format("\033[1;32m{}\033[0m  ", cell) : cell + "  ";
    }
    end_line(text);
  }
  return text;
}

std::string short_number(double value) {
  if (value == 0.0 || !std::isfinite(value)) return fmt::format("{}", value);
  const double magnitude = std::abs(value);
  if (magnitude < 1e-3 || magnitude >= 1e6) return fmt::format("{:.2e}", value);
  const int digits = std::clamp(2 - static_cast<int>(std::floor(std::log10(magnitude))), 0, 5);
  return fmt::format("{:.{}f}", value, digits);
}

}  // namespace solenoid
