#include "experiments/study/scaling.hpp"

#include "core/metrics/metrics.hpp"
#include "experiments/study/recorded_instances.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <sched.h>

namespace solenoid {
namespace {

constexpr std::array valve_sets = {"three_way", "seven_mode", "two_way"};
constexpr std::array deadlines_ms = {0.25, 0.5, 1.0, 2.5, 5.0};
constexpr int repetitions = 3;  // their median counts
constexpr double repeated_below_us = 5000.0;

/// Keeps the thread on one core while it lives: a move to another in the middle of a solve is not the search's time.
class PinnedToOneCore {
 public:
  PinnedToOneCore() {
    known_ = sched_getaffinity(0, sizeof before_, &before_) == 0;
    if (!known_) return;
    int core = CPU_SETSIZE - 1;
    while (core > 0 && !CPU_ISSET(core, &before_)) --core;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(core, &one);
    sched_setaffinity(0, sizeof one, &one);
  }
  ~PinnedToOneCore() {
    if (known_) sched_setaffinity(0, sizeof before_, &before_);
  }
  PinnedToOneCore(const PinnedToOneCore&) = delete;
  PinnedToOneCore& operator=(const PinnedToOneCore&) = delete;

 private:
  cpu_set_t before_{};
  bool known_ = false;
};

Deadline after_ms(double ms) {
  return Deadline::after(std::chrono::nanoseconds(static_cast<std::int64_t>(std::llround(1e6 * ms))));
}

/// Collects reports of one search.
class Figures {
 public:
  void add(const SolveReport& report, double us) {
    nodes_.push_back(static_cast<double>(report.nodes));
    us_.push_back(us);
    proven_ += report.status == Status::optimal;
  }
  SearchFigures summary() {
    const double count = std::max(1.0, static_cast<double>(us_.size()));
    const Percentiles n = percentiles(nodes_), t = percentiles(us_);
    return {n.p50, n.p99, n.max, t.p50, t.p99, t.max, proven_ / count};
  }

 private:
  std::vector<double> nodes_, us_;
  double proven_ = 0;
};

/// A recorded state and the one a control period before.
template <HybridModel M>
struct Moment {
  RecordedInstance<M> before, now;
};

/// `count` moments, evenly over the thesis's two motions, of a loop closed with four blocks: the same for each number
/// of blocks that is studied.
template <HybridModel M>
std::vector<Moment<M>> record_moments(const char* valves, const ScalingOptions& options) {
  const auto problem = actuator_problem<M>(valves, scaling_blocks(4), options.switching);
  const double start = problem.model.parameters().equilibrium_position_m();
  std::vector<Moment<M>> all;
  for (const Trajectory& motion : {thesis_sine(start), thesis_cycloidal(start)}) {
    BranchAndBound<M> search;
    const auto recorded = record_closed_loop(problem, motion, search);
    for (std::size_t k = 1; k < recorded.size(); ++k) all.push_back({recorded[k - 1], recorded[k]});
  }
  const std::size_t count = std::min(all.size(), static_cast<std::size_t>(options.instances));
  std::vector<Moment<M>> chosen;
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(all[(2 * i + 1) * all.size() / (2 * count)]);
  return chosen;
}

/// All searches on all moments for one problem shape.
template <HybridModel M>
class RowStudy {
 public:
  RowStudy(const Problem<M>& problem, const std::function<bool()>& stop) : problem_(problem), stop_(stop) {
    search_.prepare(problem_);
    enumerate_.prepare(problem_);
  }

  /// False when stopped before the end.
  bool run(const std::vector<Moment<M>>& moments, ScalingRow& row) {
    const bool enumerated = row.leaves <= most_enumerated;
    const auto cap = [] { return after_ms(solve_cap_ms); };
    for (const Moment<M>& moment : moments) {
      if (stop_()) return false;
      const Plan<M> warm = warm_start(moment), none(problem_);
      moment.now.pose(problem_);
      if (enumerated) measure(enumerate_, none, Deadline::never, full_);
      measure(search_, none, cap, cold_);
      measure(search_, warm, cap, warm_);
      for (std::size_t d = 0; d < deadlines_ms.size(); ++d) {
        Plan<M> plan = warm;
        const SolveReport report = search_.solve(problem_, plan, after_ms(deadlines_ms[d]));
        if (report.status != Status::optimal) gaps_[d].push_back(report.gap());
      }
    }
    if (enumerated) row.enumeration = full_.summary();
    row.cold = cold_.summary();
    row.warm = warm_.summary();
    for (std::size_t d = 0; d < deadlines_ms.size(); ++d) row.deadlines.push_back(deadline_figures(d, moments.size()));
    return true;
  }

 private:
  /// The plan that the period before has left, as the controller hands it on: found in 5 ms, then shifted.
  Plan<M> warm_start(const Moment<M>& moment) {
    moment.before.pose(problem_);
    Plan<M> plan(problem_);
    search_.solve(problem_, plan, after_ms(5.0));
    shift_plan(problem_.horizon, 5, plan);
    return plan;
  }

  template <class MakeDeadline>
  void measure(BranchAndBound<M>& search, const Plan<M>& start, MakeDeadline deadline, Figures& figures) {
    std::array<double, repetitions> us{};
    SolveReport report;
    int done = 0;
    do {
      Plan<M> plan = start;
      report = search.solve(problem_, plan, deadline());
      us[static_cast<std::size_t>(done++)] = report.time_us;
    } while (done < repetitions && us[0] < repeated_below_us);
    std::sort(us.begin(), us.begin() + done);
    figures.add(report, us[static_cast<std::size_t>(done / 2)]);
  }

  DeadlineFigures deadline_figures(std::size_t d, std::size_t count) {
    const auto open = gaps_[d].size();
    const Percentiles gap = percentiles(gaps_[d]);
    const double share = count == 0 ? 0.0 : static_cast<double>(count - open) / static_cast<double>(count);
    return {deadlines_ms[d], share, static_cast<int>(open), gap.p50, gap.p90, gap.max};
  }

  Problem<M> problem_;
  const std::function<bool()>& stop_;
  BranchAndBound<M> search_, enumerate_{{.prune = false}};
  Figures full_, cold_, warm_;
  std::array<std::vector<double>, deadlines_ms.size()> gaps_;
};

template <HybridModel M>
std::vector<ScalingRow> study(const ScalingOptions& options, const std::function<void(const std::string&)>& progress,
                              const std::function<bool()>& stop) {
  std::vector<ScalingRow> rows;
  for (const char* valves : valve_sets) {
    progress(fmt::format("{}: recording", valves));
    const auto moments = record_moments<M>(valves, options);
    for (int blocks = 1; blocks <= most_blocks; ++blocks) {
      ScalingRow row;
      row.valves = valves;
      row.periods = scaling_blocks(blocks);
      const auto problem = actuator_problem<M>(valves, row.periods, options.switching);
      row.states = problem.modes.size();
      row.leaves = std::pow(row.states, blocks);
      for (int b = 1; b <= blocks; ++b) row.full_tree += std::pow(row.states, b);
      progress(fmt::format("{}: {} of {} blocks", valves, blocks, most_blocks));
      if (!RowStudy<M>(problem, stop).run(moments, row)) return rows;
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

}  // namespace

std::vector<int> scaling_blocks(int count) {
  static const std::array<std::vector<int>, most_blocks> ladder = {{{20},
                                                                    {4, 16},
                                                                    {2, 4, 14},
                                                                    {2, 2, 4, 12},
                                                                    {1, 1, 2, 4, 12},
                                                                    {1, 1, 2, 2, 4, 10},
                                                                    {1, 1, 1, 2, 2, 4, 9},
                                                                    {1, 1, 1, 1, 2, 2, 4, 8}}};
  return ladder.at(static_cast<std::size_t>(count - 1));
}

std::vector<ScalingRow> study_scaling(const ScalingOptions& options,
                                      const std::function<void(const std::string&)>& progress,
                                      const std::function<bool()>& stop) {
  const PinnedToOneCore pinned;
  return options.cylinder ? study<PneumaticActuator>(options, progress, stop)
                          : study<PrestabilisedActuator>(options, progress, stop);
}

}  // namespace solenoid
