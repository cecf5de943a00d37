#include "experiments/study/scaling_study.hpp"

#include "core/metrics/metrics.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace solenoid::scaling {
namespace {

constexpr int repetitions = 3;  // their median counts
constexpr double repeated_below_us = 5000.0;

Deadline after_ms(double ms) { return Deadline::after_s(1e-3 * ms); }

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

/// Poses a moment's state and as much of its reference as the problem's horizon has.
void pose_moment(const AnyProblem& moment, AnyProblem& problem) {
  const auto take = [](std::span<const double> from, std::span<double> to) {
    std::copy_n(from.begin(), to.size(), to.begin());
  };
  take(moment.initial_values(), problem.initial_values());
  take(moment.reference_values(), problem.reference_values());
  take(moment.setpoint_values(), problem.setpoint_values());
  problem.lines = moment.lines;
}

/// All searches on all moments for one problem shape.
class RowStudy {
 public:
  RowStudy(const ModeSetStudy& study, std::unique_ptr<AnyProblem> problem, const std::function<bool()>& stop)
      : problem_(std::move(problem)),
        timing_(study.timing),
        stop_(stop),
        search_(study.search(true)),
        enumerate_(study.search(false)) {
    search_->prepare(*problem_);
    enumerate_->prepare(*problem_);
  }

  /// False when stopped before the end.
  bool run(const std::vector<Moment>& moments, ScalingRow& row) {
    const bool enumerated = row.leaves <= most_enumerated;
    const auto cap = [] { return after_ms(solve_cap_ms); };
    for (const Moment& moment : moments) {
      if (stop_()) return false;
      const Held<AnyPlan> warm = warm_start(moment), none(problem_->new_plan());
      pose_moment(*moment.now, *problem_);
      if (enumerated) measure(*enumerate_, *none, Deadline::never, full_);
      measure(*search_, *none, cap, cold_);
      measure(*search_, *warm, cap, warm_);
      for (std::size_t d = 0; d < deadline_shares.size(); ++d) {
        Held<AnyPlan> plan = warm;
        const SolveReport report = search_->solve(*problem_, *plan, after_ms(deadline_ms(d)));
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
  Held<AnyPlan> warm_start(const Moment& moment) {
    pose_moment(*moment.before, *problem_);
    Held<AnyPlan> plan(problem_->new_plan());
    search_->solve(*problem_, *plan, after_ms(1e3 * timing_.period_s()));
    shift_plan(problem_->horizon, timing_.ticks_per_period, *plan);
    return plan;
  }

  template <class MakeDeadline>
  void measure(AnySolver& search, const AnyPlan& start, MakeDeadline deadline, Figures& figures) {
    std::array<double, repetitions> us{};
    SolveReport report;
    int done = 0;
    do {
      Held<AnyPlan> plan(start);
      report = search.solve(*problem_, *plan, deadline());
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

  std::unique_ptr<AnyProblem> problem_;
  Timing timing_;
  const std::function<bool()>& stop_;
  AnySolverPtr search_, enumerate_;
  Figures full_, cold_, warm_;
  std::array<std::vector<double>, deadline_shares.size()> gaps_;
};

}  // namespace

std::vector<Moment> some_moments(const std::vector<Moment>& all, int count) {
  const std::size_t kept = std::min(all.size(), static_cast<std::size_t>(count));
  std::vector<Moment> chosen;
  for (std::size_t i = 0; i < kept; ++i) chosen.push_back(all[(2 * i + 1) * all.size() / (2 * kept)]);
  return chosen;
}

bool study_mode_set(const ModeSetStudy& study, const std::function<void(const std::string&)>& progress,
                    const std::function<bool()>& stop, std::vector<ScalingRow>& rows) {
  for (int blocks = 1; blocks <= most_blocks; ++blocks) {
    auto problem = study.problem(blocks);
    ScalingRow row;
    row.mode_set = study.name;
    for (const int steps : problem->horizon.blocks) row.periods.push_back(steps / study.timing.ticks_per_period);
    row.states = problem->modes.size();
    row.leaves = std::pow(row.states, blocks);
    for (int b = 1; b <= blocks; ++b) row.full_tree += std::pow(row.states, b);
    progress(fmt::format("{}: {} of {} blocks", study.name, blocks, most_blocks));
    if (!RowStudy(study, std::move(problem), stop).run(study.moments, row)) return false;
    rows.push_back(std::move(row));
  }
  return true;
}

}  // namespace solenoid::scaling
