#pragma once

#include "experiments/report/max_t.hpp"
#include "experiments/report/task_errors.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace solenoid {

/// A variant against a baseline over the tasks, scenarios with a seed, that both ended well.
struct Paired {
  struct Interval {
    double low = 0, high = 0;
  };
  enum class Verdict { better, worse, no_difference_shown };

  std::uint32_t variant = 0, baseline = 0;  ///< numbers of the table's
  std::size_t tasks = 0;                    ///< that both ended well: all numbers below are over these
  std::size_t lost = 0, baseline_lost = 0;  ///< tasks that both ran: where the variant, the baseline did not end well
  double ratio = 0;                         ///< of the geometric means of their errors; NaN without a task
  double better = 0;  ///< share of the tasks where the variant's error is less; equal ones are halves
  /// Intervals of the ratio at 95 %: by itself; and corrected, so that all of a family hold at once. None from fewer
  /// than MaxT::least_values scenarios, or where the ratio is the same in all of them.
  std::optional<Interval> own = {}, corrected = {};
  std::optional<double> p = {};  ///< of no difference, two-sided, corrected
  std::optional<Verdict> verdict =
      {};  ///< better or worse where the corrected interval excludes 1; none without an interval
};

/// Comparisons that are corrected together.
struct PairedFamily {
  std::vector<Paired> rows;
  std::size_t comparisons = 0;  ///< those that have an interval
};

/// Every variant of a table against every other, paired by tasks. The logarithms of the ratios of the judged errors
/// have a mean over tasks, whose interval comes from resampling scenarios (MaxT), so that seeds of one stay together;
/// of a single scenario its seeds are resampled, and what is found holds for it alone. Of more than most_units
/// scenarios as many groups of them are, alike in size and drawn by their names: their sums have the same spread.
///
/// A baseline that was chosen before the errors were seen is one of a family of V - 1 comparisons. One that the errors
/// chose, as the best ranked is, or that a reader chooses from a page, has had V (V - 1) / 2 chances: the family is all
/// pairs, and the correction is larger.
///
/// With the baseline in the variant's place: 1 / ratio, the mirrored intervals, the same p. The order of runs and of
/// variants changes nothing.
class PairedVariants {
 public:
  static constexpr std::size_t most_units = 500;

  explicit PairedVariants(const RunTable& runs, std::optional<std::uint32_t> group = {});

  const TaskErrors& errors() const { return errors_; }
  std::size_t units() const { return units_; }                ///< that are resampled
  bool of_seeds() const { return errors_.scenarios() == 1; }  ///< those of a single scenario
  bool grouped() const { return (of_seeds() ? errors_.tasks() : errors_.scenarios()) > units_; }
  /// The other variants against one, whose comparisons are the family; in the table's order.
  PairedFamily against(std::uint32_t baseline) const;
  /// Every variant against every other, both ways round, corrected over all pairs; by baseline, then variant.
  PairedFamily all() const;

 private:
  struct Pair {
    std::uint32_t a = 0, b = 0;
    std::size_t tasks = 0, lost_a = 0, lost_b = 0;
    double better = 0, log_ratio = 0, error = 0;  // of a against b; standard error
    std::optional<std::size_t> mean = {};         // of MaxT
  };
  std::vector<double> compare(Pair& pair, const std::vector<double>& logs) const;
  std::size_t unit(std::size_t task) const;
  Paired paired(const Pair& pair, bool turned, const std::optional<MaxT::Family>& family) const;
  std::optional<MaxT::Family> family(const std::vector<std::size_t>& pairs, std::size_t& comparisons) const;

  TaskErrors errors_;
  std::size_t units_ = 0;
  std::vector<Pair> pairs_;  // by names
  std::optional<MaxT> resampled_;
  std::vector<double> critical_;  // of a mean by itself
};

}  // namespace solenoid
