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
  /// than MaxT::least_values scenarios, nor where the ratio is the same in all of them, or in all but one or two: then
  /// more than 5 % of the resamples have neither of these. Where several pairs that are nearly tied would together take
  /// the intervals of a whole family away, those nearest to a tie have theirs by itself alone (MaxT::bounded_family),
  /// without p and verdict.
  std::optional<Interval> own = {}, corrected = {};
  std::optional<double> p = {};  ///< of no difference, two-sided, corrected
  std::optional<Verdict> verdict =
      {};  ///< better or worse where the corrected interval excludes 1; none without that interval
};

/// Comparisons that are corrected together.
struct PairedFamily {
  std::vector<Paired> rows;
  std::size_t comparisons = 0;  ///< those that have a corrected interval; of the others nothing is claimed
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
/// Pairs grow with the square of V, at 40 kB each. Of more than most_variants variants only those with one baseline are
/// compared: a family if it was chosen before, and else without correction, so without a verdict.
///
/// With the baseline in the variant's place: 1 / ratio, the mirrored intervals, the same p. The order of runs and of
/// variants changes nothing.
class PairedVariants {
 public:
  static constexpr std::size_t most_units = 500;
  static constexpr std::size_t most_variants = 40;

  /// `baseline`: whom all are compared with where they are too many for all pairs; none: then there is no pair at all.
  explicit PairedVariants(const RunTable& runs, std::optional<std::uint32_t> group = {},
                          std::optional<std::uint32_t> baseline = {});

  const TaskErrors& errors() const { return errors_; }
  std::size_t units() const { return units_; }                ///< that are resampled
  bool of_seeds() const { return errors_.scenarios() == 1; }  ///< those of a single scenario
  bool grouped() const { return (of_seeds() ? errors_.tasks() : errors_.scenarios()) > units_; }
  /// Whether every variant is compared with every other.
  bool every_pair() const { return errors_.variants() <= most_variants; }
  /// The other variants against one, whose comparisons are the family; in the table's order.
  PairedFamily against(std::uint32_t baseline) const;
  /// All pairs, both ways round, corrected over all of them, or not at all without every_pair(); by baseline, then
  /// variant.
  PairedFamily all() const;

 private:
  struct Pair {
    std::uint32_t a = 0, b = 0;
    std::size_t tasks = 0, lost_a = 0, lost_b = 0;
    double better = 0, log_ratio = 0, error = 0;  // of a against b; standard error
    std::optional<std::size_t> mean = {};         // of MaxT
  };
  /// Means that are corrected together, increasing, and how.
  struct Together {
    std::vector<std::size_t> means = {};
    std::optional<MaxT::Family> family = {};  // none without a mean
  };
  std::vector<double> compare(Pair& pair, const std::vector<double>& logs) const;
  std::size_t unit(std::size_t task) const;
  Paired paired(const Pair& pair, bool turned, const Together& together) const;
  Together together(const std::vector<std::size_t>& pairs) const;

  TaskErrors errors_;
  std::size_t units_ = 0;
  std::vector<Pair> pairs_;  // by names
  std::optional<MaxT> resampled_;
  std::vector<double> critical_;  // of a mean by itself
};

}  // namespace solenoid
