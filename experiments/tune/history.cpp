#include "experiments/tune/history.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/report/headings.hpp"

#include <charconv>
#include <cmath>
#include <span>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

/// objective, error, worst error, overshoot, SSE, efforts, runs, bad
constexpr std::size_t before_efforts = 5, after_efforts = 2;

std::string heading_of(const std::vector<FreeParameter>& free, const SystemDescription& system,
                       const std::string& identity) {
  std::vector<std::string> columns = {"objective", system.judged.metric, "worst_" + system.judged.metric,
                                      "overshoot_percent", "sse_mm"};
  for (const MetricColumn& effort : effort_metrics(system)) columns.push_back(effort.key);
  columns.insert(columns.end(), {"runs", "bad"});
  std::string heading = fmt::format("# {}\nstep", identity);
  for (const char* group : {"", "held_out_"})
    for (const std::string& column : columns) heading += fmt::format(",{}{}", group, column);
  for (const FreeParameter& p : free) heading += "," + p.key;
  return heading + "\n";
}

std::string cells_of(const std::optional<Score>& s, std::size_t columns) {
  if (!s) return std::string(columns, ',');
  std::vector<double> efforts = s->efforts;
  efforts.resize(columns - before_efforts - after_efforts);
  return fmt::format(",{},{},{},{},{}{}{},{},{}", s->objective, s->error, s->worst_error, s->overshoot_percent,
                     s->sse_mm, efforts.empty() ? "" : ",", fmt::join(efforts, ","), s->runs, s->bad);
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line + ",");
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  return cells;
}

Score score_from(std::span<const double> c) {
  const std::span<const double> efforts = c.subspan(before_efforts, c.size() - before_efforts - after_efforts);
  return {c[0],
          c[1],
          c[2],
          c[3],
          c[4],
          {efforts.begin(), efforts.end()},
          static_cast<int>(c[c.size() - 2]),
          static_cast<int>(c[c.size() - 1])};
}

/// A line of numbers, empty cells as 0; nothing for a line that was cut or spoiled.
std::optional<TuneStep> step_from(const std::string& line, std::size_t score_columns, std::size_t parameters) {
  const std::vector<std::string> cells = split(line);
  if (cells.size() != 1 + 2 * score_columns + parameters) return std::nullopt;
  std::vector<double> numbers;
  for (const std::string& cell : cells) {
    double value = 0.0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (!cell.empty() && (error != std::errc() || end != cell.data() + cell.size())) return std::nullopt;
    if (std::isnan(value)) return std::nullopt;  // it finds nothing, itself included
    numbers.push_back(value);
  }
  TuneStep step;
  const std::span<const double> all(numbers);
  step.training = score_from(all.subspan(1, score_columns));
  if (!cells[1 + score_columns].empty()) step.held_out = score_from(all.subspan(1 + score_columns, score_columns));
  const auto values = all.subspan(1 + 2 * score_columns);
  step.values.assign(values.begin(), values.end());
  return step;
}

}  // namespace

TuneHistory::TuneHistory(const std::string& folder, const std::vector<FreeParameter>& free,
                         const SystemDescription& system, const std::string& identity)
    : path_(folder + "/history.csv"),
      heading_(heading_of(free, system, identity)),
      score_columns_(before_efforts + effort_metrics(system).size() + after_efforts) {
  const auto text = read_whole_file(path_, file_size::linked);
  if (!text) return;
  if (!text->starts_with(heading_))
    throw ConfigError(path_ + ": is another tuning run's (allowed: a new folder, or the settings it was begun with)");
  std::istringstream lines(text->substr(heading_.size()));
  for (std::string line; std::getline(lines, line);)
    if (auto step = step_from(line, score_columns_, free.size())) known_.emplace(step->values, *step);
}

const TuneStep* TuneHistory::find(const std::vector<double>& values) const {
  const auto found = known_.find(values);
  return found == known_.end() ? nullptr : &found->second;
}

void TuneHistory::write(const std::vector<TuneStep>& steps) const {
  std::string text = heading_;
  for (std::size_t i = 0; i < steps.size(); ++i)
    text += fmt::format("{}{}{},{}\n", i, cells_of(steps[i].training, score_columns_),
                        cells_of(steps[i].held_out, score_columns_), fmt::join(steps[i].values, ","));
  write_file_atomically(path_, text);
}

}  // namespace solenoid
