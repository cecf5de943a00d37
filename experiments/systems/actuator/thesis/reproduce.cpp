#include "experiments/systems/actuator/thesis/reproduce.hpp"

#include "core/config/reader.hpp"
#include "experiments/systems/actuator/thesis/cases.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <numeric>
#include <thread>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

/// ours[comparison][seed] of one case.
using Figures = std::vector<std::vector<double>>;

struct Job {
  std::size_t case_index, seed_index;
};

void run_job(const ReproducedCase& c, const Job& job, Figures& figures) {
  const RunResult result = simulate(c.variant, c.scenario, c.seeds[job.seed_index]);
  for (std::size_t m = 0; m < c.compared.size(); ++m)
    figures[m][job.seed_index] = c.compared[m].ours(result, c.scenario);
}

/// Every job once, on `jobs` threads: a run shares nothing with another. Rethrows the first failure.
void run_all(std::size_t count, int jobs, const std::function<void(std::size_t)>& run,
             const std::function<void(std::size_t, std::size_t)>& progress) {
  std::atomic<std::size_t> next{0};
  std::size_t done = 0;
  std::exception_ptr failed;
  std::mutex mutex;
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        run(i);
        const std::lock_guard lock(mutex);
        if (++done; progress) progress(done, count);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failed) failed = std::current_exception();
        next = count;
      }
    }
  };
  {
    std::vector<std::jthread> others;
    for (int j = 1; j < jobs; ++j) others.emplace_back(work);
    work();
  }
  if (failed) std::rethrow_exception(failed);
}

Cell make_cell(const ReproducedCase& c, const Comparison& compared, const std::vector<double>& ours) {
  const auto n = static_cast<double>(ours.size());
  const double mean = std::accumulate(ours.begin(), ours.end(), 0.0) / n;
  double squares = 0.0;
  for (const double value : ours) squares += (value - mean) * (value - mean);
  return {c.table,
          c.parameters,
          c.name,
          compared.metric,
          compared.thesis,
          mean,
          n > 1 ? std::sqrt(squares / (n - 1)) : 0.0,
          static_cast<int>(ours.size())};
}

/// Tables whose agreement is one number, and the metrics it is stated for.
struct Together {
  std::string name, prefix;
  std::vector<std::string> metrics;
};
const std::vector<Together> tables_together = {
    {"table 5-2", "table-5-2", {"sse_max_abs_measured_mm"}},
    {"table 5-3", "table-5-3", {"sse_max_abs_measured_mm"}},
    {"table 5-4", "table-5-4", {"sse_max_abs_measured_mm"}},
    {"chapter 6", "table-6-", {"rmse_mm", "mae_mm"}},
    {"chapter 7", "table-7-", {"rmse_measured_mm", "mae_measured_mm", "sse_measured_mm", "ssa_measured_mm"}},
};

/// In order of appearance.
std::vector<std::string> parameters_of(std::span<const Cell> cells, const std::string& prefix) {
  std::vector<std::string> found;
  for (const Cell& c : cells)
    if (c.table.starts_with(prefix) && std::ranges::find(found, c.parameters) == found.end())
      found.push_back(c.parameters);
  return found;
}

}  // namespace

const std::vector<ReproducibleTable>& reproducible_tables() {
  static const std::vector<ReproducibleTable> tables = {
      {"table-5-2", "steps of 60 mm, DMPC without I, no payload, by prediction horizon; thesis: one test on the rig",
       hardware_table},
      {"table-5-3", "steps of 60 mm, DMPC without I, by payload; thesis: mean of five tests on the rig",
       hardware_table},
      {"table-5-4", "steps of 60 mm, DMPC+I, by payload; thesis: mean of five tests on the rig", hardware_table},
      {"table-6-1", "vertical cycloidal motion, simulated; thesis: its own simulation", simulation_table},
      {"table-6-2", "vertical sine motion, simulated; thesis: its own simulation", simulation_table},
      {"table-7-1", "vertical cycloidal motion, cylinder alone; thesis: mean of five tests on the rig", hardware_table},
      {"table-7-2", "vertical cycloidal motion, PD motor; thesis: mean of five tests on the rig", hardware_table},
      {"table-7-3", "the same with 0.15 kg", hardware_table},
      {"table-7-4", "the same with 0.46 kg", hardware_table},
      {"table-7-5", "vertical sine motion, cylinder alone; thesis: mean of five tests on the rig", hardware_table},
      {"table-7-6", "vertical sine motion, PD motor; thesis: mean of five tests on the rig", hardware_table},
      {"table-7-7", "the same with 0.15 kg", hardware_table},
      {"table-7-8", "horizontal sine motion, PD motor; thesis: mean of five tests on the rig", hardware_table},
      {"table-7-9", "the same with 0.46 kg", hardware_table},
  };
  return tables;
}

std::vector<ReproducibleTable> select_tables(const std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const ReproducibleTable& table : reproducible_tables()) known.push_back(table.name);
  for (const std::string& name : names)
    if (name != "all" && std::find(known.begin(), known.end(), name) == known.end())
      throw ConfigError(
          fmt::format("reproduce: table '{}' is not known (allowed: {}, all)", name, fmt::join(known, ", ")));
  const auto named = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  std::vector<ReproducibleTable> selected;
  for (const ReproducibleTable& table : reproducible_tables())
    if (names.empty() || named("all") || named(table.name)) selected.push_back(table);
  return selected;
}

std::vector<Cell> reproduce(const std::vector<ReproducedCase>& cases, int jobs,
                            const std::function<void(std::size_t, std::size_t)>& progress) {
  std::vector<Job> queue;
  std::vector<Figures> figures;
  for (std::size_t c = 0; c < cases.size(); ++c) {
    figures.emplace_back(cases[c].compared.size(), std::vector<double>(cases[c].seeds.size()));
    for (std::size_t s = 0; s < cases[c].seeds.size(); ++s) queue.push_back({c, s});
  }
  run_all(
      queue.size(), jobs,
      [&](std::size_t i) { run_job(cases[queue[i].case_index], queue[i], figures[queue[i].case_index]); }, progress);
  std::vector<Cell> cells;
  for (std::size_t c = 0; c < cases.size(); ++c)
    for (std::size_t m = 0; m < cases[c].compared.size(); ++m)
      cells.push_back(make_cell(cases[c], cases[c].compared[m], figures[c][m]));
  return cells;
}

double mean_abs_ln(std::span<const Cell> cells, const std::function<bool(const Cell&)>& counted) {
  double sum = 0.0;
  int n = 0;
  for (const Cell& cell : cells) {
    if (!cell.thesis || !counted(cell)) continue;
    sum += std::abs(std::log(cell.ours / cell.thesis->value));
    ++n;
  }
  return n > 0 ? sum / n : 0.0;
}

std::vector<Agreement> agreements(std::span<const Cell> cells) {
  std::vector<Agreement> all;
  for (const Together& group : tables_together)
    for (const std::string& metric : group.metrics)
      for (const std::string& parameters : parameters_of(cells, group.prefix)) {
        const auto counted = [&](const Cell& c) {
          return c.table.starts_with(group.prefix) && c.metric == metric && c.parameters == parameters && c.thesis;
        };
        const auto n = static_cast<int>(std::ranges::count_if(cells, counted));
        if (n > 0) all.push_back({group.name, parameters, metric, mean_abs_ln(cells, counted), n});
      }
  return all;
}

}  // namespace solenoid
