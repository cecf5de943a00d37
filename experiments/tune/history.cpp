#include "experiments/tune/history.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"

#include <charconv>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr std::size_t score_columns = 9;

std::string heading_of(const std::vector<FreeParameter>& free, const std::string& identity) {
  std::string heading = fmt::format("# {}\nstep", identity);
  for (const char* group : {"", "held_out_"})
    for (const char* column : {"objective", "rmse_mm", "worst_rmse_mm", "overshoot_percent", "sse_mm", "switches_per_s",
                               "air_g", "runs", "bad"})
      heading += fmt::format(",{}{}", group, column);
  for (const FreeParameter& p : free) heading += "," + p.key;
  return heading + "\n";
}

std::string cells_of(const std::optional<Score>& s) {
  if (!s) return std::string(score_columns, ',');
  return fmt::format(",{},{},{},{},{},{},{},{},{}", s->objective, s->rmse_mm, s->worst_rmse_mm, s->overshoot_percent,
                     s->sse_mm, s->switches_per_s, s->air_g, s->runs, s->bad);
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line + ",");
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  return cells;
}

Score score_from(const std::vector<double>& c, std::size_t at) {
  return {c[at],
          c[at + 1],
          c[at + 2],
          c[at + 3],
          c[at + 4],
          c[at + 5],
          c[at + 6],
          static_cast<int>(c[at + 7]),
          static_cast<int>(c[at + 8])};
}

/// A line of numbers, empty cells as 0; nothing for a line that was cut or spoiled.
std::optional<TuneStep> step_from(const std::string& line, std::size_t parameters) {
  const std::vector<std::string> cells = split(line);
  if (cells.size() != 1 + 2 * score_columns + parameters) return std::nullopt;
  std::vector<double> numbers;
  for (const std::string& cell : cells) {
    double value = 0.0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (!cell.empty() && (error != std::errc() || end != cell.data() + cell.size())) return std::nullopt;
    numbers.push_back(value);
  }
  TuneStep step;
  step.training = score_from(numbers, 1);
  if (!cells[1 + score_columns].empty()) step.held_out = score_from(numbers, 1 + score_columns);
  step.values.assign(numbers.begin() + 1 + 2 * score_columns, numbers.end());
  return step;
}

}  // namespace

TuneHistory::TuneHistory(const std::string& folder, const std::vector<FreeParameter>& free, const std::string& identity)
    : path_(folder + "/history.csv"), heading_(heading_of(free, identity)) {
  const auto text = read_whole_file(path_);
  if (!text) return;
  if (!text->starts_with(heading_))
    throw ConfigError(path_ + ": is another tuning run's (allowed: a new folder, or the settings it was begun with)");
  std::istringstream lines(text->substr(heading_.size()));
  for (std::string line; std::getline(lines, line);)
    if (auto step = step_from(line, free.size())) known_.emplace(step->values, *step);
}

const TuneStep* TuneHistory::find(const std::vector<double>& values) const {
  const auto found = known_.find(values);
  return found == known_.end() ? nullptr : &found->second;
}

void TuneHistory::write(const std::vector<TuneStep>& steps) const {
  std::string text = heading_;
  for (std::size_t i = 0; i < steps.size(); ++i)
    text += fmt::format("{}{}{},{}\n", i, cells_of(steps[i].training), cells_of(steps[i].held_out),
                        fmt::join(steps[i].values, ","));
  write_file_atomically(path_, text);
}

}  // namespace solenoid
