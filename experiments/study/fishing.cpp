#include "experiments/study/fishing.hpp"

#include "experiments/study/lotka_volterra.hpp"
#include "solvers/rounding/integral_approximation.hpp"
#include "solvers/rounding/mode_swaps.hpp"
#include "solvers/rounding/projected_gradient.hpp"
#include "solvers/rounding/sum_up_rounding.hpp"

#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Fishing = LotkaVolterraFishing;

/// One grid: its problem, relaxed.
class Grid {
 public:
  explicit Grid(int intervals)
      : problem(fishing_problem(12.0 / fishing_model_steps, blocks(intervals))),
        weights(2, std::vector<double>(static_cast<std::size_t>(intervals), 12.0 / intervals)) {
    const RelaxedGrid grid = control_grid(problem.horizon, 0);
    ProjectedGradient<Fishing> solver({.most_iterations = 2000, .tolerance = 1e-9});
    solver.prepare(problem, grid);
    RelaxedPlan<Fishing> plan(problem, grid);
    report = solver.solve(problem, plan, Deadline::never());
    relaxed = fishing_integral(problem, plan.outputs);
    weights.weight = plan.weights;
    if (!normalise(weights)) throw std::runtime_error("fishing: the relaxed problem was not solved");
  }

  /// The integral that these modes cost, and their switches.
  double cost(const std::vector<int>& modes, int* switches = nullptr) const {
    Plan<Fishing> plan(problem);
    plan.modes = modes;
    plan.outputs.resize(problem.reference.size());
    const SolveReport judged = evaluate(problem, plan);
    if (switches) *switches = judged.switches;
    return fishing_integral(problem, plan.outputs);
  }

  std::vector<int> improved(const std::vector<int>& modes, int max_switches) const {
    ModeSwaps<Fishing> swaps({.max_switches = max_switches});
    swaps.prepare(problem);
    Plan<Fishing> plan(problem);
    plan.modes = modes;
    swaps.improve(problem, plan, Deadline::never());
    return plan.modes;
  }

  ApproximationReport approximate(int max_switches, std::vector<int>& modes) const {
    SwitchLimits limits = mode_set_limits(problem.modes, SwitchTiming(problem.modes, problem.horizon.dt_s), {});
    limits.max_changes = max_switches;
    IntegralApproximation search({.max_nodes = 20'000'000, .table_entries = 1 << 18});
    search.prepare(weights.intervals(), 2, 1);
    return search.solve(weights, limits, modes, Deadline::never());
  }

  Problem<Fishing> problem;
  ModeWeights weights;
  SolveReport report;
  double relaxed = 0.0;

 private:
  static std::vector<int> blocks(int intervals) {
    if (intervals < 1 || fishing_model_steps % intervals != 0)
      throw std::invalid_argument(
          fmt::format("fishing: {} intervals do not divide {}", intervals, fishing_model_steps));
    return std::vector<int>(static_cast<std::size_t>(intervals), fishing_model_steps / intervals);
  }
};

FishingRow row_of(const Grid& grid) {
  FishingRow row;
  row.intervals = static_cast<int>(grid.weights.intervals());
  row.relaxed = grid.relaxed;
  row.relaxing_ms = 1e-3 * grid.report.time_us;
  row.iterations = static_cast<int>(grid.report.nodes);
  std::vector<int> modes;
  const SumUpReport rounded = sum_up_rounding(grid.weights, modes);
  row.sum_up_gap = rounded.gap;
  row.guarantee = rounded.guarantee;
  row.sum_up = grid.cost(modes, &row.sum_up_switches);
  std::vector<int> nearest = modes;
  row.approximated_gap = grid.approximate(SwitchLimits::unlimited, nearest).cost;
  row.approximated = grid.cost(nearest);
  const std::vector<int> better =
      grid.improved(row.approximated < row.sum_up ? nearest : modes, std::numeric_limits<int>::max());
  row.improved = grid.cost(better, &row.improved_switches);
  return row;
}

/// Two switches of a plan on `intervals` equal ones, moved by 32nds of an interval on a model 8 times finer. Returns
/// the cost.
double refined(const std::vector<int>& modes, FishingWithTwoSwitches& two) {
  constexpr int finer = 8, steps = finer * fishing_model_steps, reach = 2;  // old intervals either side of a switch
  const int length = steps / static_cast<int>(modes.size());
  const int cell = std::gcd(length, std::max(1, length / 32));
  std::vector<int> blocks, fine_modes;
  for (int k = 0; k < static_cast<int>(modes.size()); ++k) {
    bool near = false;
    for (int i = std::max(1, k - reach + 1); i <= std::min(k + reach, static_cast<int>(modes.size()) - 1); ++i)
      near = near || modes[static_cast<std::size_t>(i)] != modes[static_cast<std::size_t>(i) - 1];
    blocks.insert(blocks.end(), static_cast<std::size_t>(near ? length / cell : 1), near ? cell : length);
    fine_modes.resize(blocks.size(), modes[static_cast<std::size_t>(k)]);
  }
  const auto problem = fishing_problem(12.0 / steps, blocks);
  ModeSwaps<Fishing> swaps({.max_switches = 2});
  swaps.prepare(problem);
  Plan<Fishing> plan(problem);
  plan.modes = fine_modes;
  plan.outputs.resize(problem.reference.size());
  swaps.improve(problem, plan, Deadline::never());
  evaluate(problem, plan);
  int at = 0;
  two.from = two.to = 0.0;
  for (std::size_t b = 0; b < blocks.size(); at += blocks[b++]) {
    if (plan.modes[b] == 1 && (b == 0 || plan.modes[b - 1] == 0)) two.from = 12.0 * at / steps;
    if (plan.modes[b] == 1) two.to = 12.0 * (at + blocks[b]) / steps;
  }
  return fishing_integral(problem, plan.outputs);
}

FishingWithTwoSwitches with_two_switches(const Grid& grid) {
  const auto start = Deadline::Clock::now();
  FishingWithTwoSwitches two;
  two.intervals = static_cast<int>(grid.weights.intervals());
  std::vector<int> modes(grid.weights.intervals(), 0);
  const ApproximationReport found = grid.approximate(2, modes);
  two.gap = found.cost;
  two.gap_bound = found.bound;
  two.approximated = grid.cost(modes);
  modes = grid.improved(modes, 2);
  two.improved = grid.cost(modes);
  two.refined = refined(modes, two);
  two.milliseconds = std::chrono::duration<double, std::milli>(Deadline::Clock::now() - start).count();
  return two;
}

/// Slope of log(excess) against log(length) by least squares, over the grids on which rounding costs something.
double fitted_order(const std::vector<FishingRow>& rows, double optimum) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const FishingRow& row : rows) {
    const double excess = row.sum_up - optimum;
    if (!(excess > 0.0)) continue;
    const double x = std::log(12.0 / row.intervals), y = std::log(excess);
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace

FishingStudy study_fishing(const std::vector<int>& intervals, const std::function<void(const std::string&)>& progress,
                           const std::function<bool()>& stop) {
  FishingStudy study;
  int two_switch_grid = 0;
  for (const int count : intervals)
    if (count <= 384) two_switch_grid = std::max(two_switch_grid, count);
  for (const int count : intervals) {
    if (stop()) break;
    progress(fmt::format("{} intervals", count));
    const Grid grid(count);
    study.rows.push_back(row_of(grid));
    if (count == two_switch_grid) study.two = with_two_switches(grid);
  }
  if (study.rows.size() > 1) study.order = fitted_order(study.rows, study.rows.back().relaxed);
  return study;
}

}  // namespace solenoid
