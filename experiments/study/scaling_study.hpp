#pragma once

#include "core/metrics/metrics.hpp"
#include "experiments/study/recorded_instances.hpp"
#include "experiments/study/scaling.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace solenoid::scaling {

/// How each row of the study is measured, whatever the model (scaling.hpp).
inline constexpr int repetitions = 3;  ///< their median counts
inline constexpr double repeated_below_us = 5000.0;

inline Deadline after_ms(double ms) { return Deadline::after_s(1e-3 * ms); }

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

/// All searches on all moments for one problem shape.
template <HybridModel M>
class RowStudy {
 public:
  RowStudy(const Problem<M>& problem, const Timing& timing, const std::function<bool()>& stop)
      : problem_(problem), timing_(timing), stop_(stop) {
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
      for (std::size_t d = 0; d < deadline_shares.size(); ++d) {
        Plan<M> plan = warm;
        const SolveReport report = search_.solve(problem_, plan, after_ms(deadline_ms(d)));
        if (report.status != Status::optimal) gaps_[d].push_back(report.gap());
      }
    }
    if (enumerated) row.enumeration = full_.summary();
    row.cold = cold_.summary();
    row.warm = warm_.summary();
    for (std::size_t d = 0; d < deadline_shares.size(); ++d)
      row.deadlines.push_back(deadline_figures(d, moments.size()));
    return true;
  }

 private:
  double deadline_ms(std::size_t d) const { return 1e3 * deadline_shares[d] * timing_.period_s(); }

  /// The plan that the period before has left, as the controller hands it on: found in a period, then shifted.
  Plan<M> warm_start(const Moment<M>& moment) {
    moment.before.pose(problem_);
    Plan<M> plan(problem_);
    search_.solve(problem_, plan, after_ms(1e3 * timing_.period_s()));
    shift_plan(problem_.horizon, timing_.ticks_per_period, plan);
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
    return {deadline_ms(d), share, static_cast<int>(open), gap.p50, gap.p90, gap.max};
  }

  Problem<M> problem_;
  Timing timing_;
  const std::function<bool()>& stop_;
  BranchAndBound<M> search_, enumerate_{{.prune = false}};
  Figures full_, cold_, warm_;
  std::array<std::vector<double>, deadline_shares.size()> gaps_;
};

/// `count` of these moments, evenly over them.
template <HybridModel M>
std::vector<Moment<M>> some_moments(const std::vector<Moment<M>>& all, int count) {
  const std::size_t kept = std::min(all.size(), static_cast<std::size_t>(count));
  std::vector<Moment<M>> chosen;
  for (std::size_t i = 0; i < kept; ++i) chosen.push_back(all[(2 * i + 1) * all.size() / (2 * kept)]);
  return chosen;
}

/// The rows of one mode set: problem(blocks) with 1 to most_blocks of them, all on the same moments. False when stopped.
template <HybridModel M, class MakeProblem>
bool study_mode_set(const std::string& name, const std::vector<Moment<M>>& moments, const Timing& timing,
                    const MakeProblem& problem_with, const std::function<void(const std::string&)>& progress,
                    const std::function<bool()>& stop, std::vector<ScalingRow>& rows) {
  for (int blocks = 1; blocks <= most_blocks; ++blocks) {
    const Problem<M> problem = problem_with(blocks);
    ScalingRow row;
    row.mode_set = name;
    for (const int steps : problem.horizon.blocks) row.periods.push_back(steps / timing.ticks_per_period);
    row.states = problem.modes.size();
    row.leaves = std::pow(row.states, blocks);
    for (int b = 1; b <= blocks; ++b) row.full_tree += std::pow(row.states, b);
    progress(fmt::format("{}: {} of {} blocks", name, blocks, most_blocks));
    if (!RowStudy<M>(problem, timing, stop).run(moments, row)) return false;
    rows.push_back(std::move(row));
  }
  return true;
}

}  // namespace solenoid::scaling
