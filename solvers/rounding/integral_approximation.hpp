#pragma once

#include "core/mpc/deadline.hpp"
#include "core/mpc/plan.hpp"
#include "solvers/rounding/mode_weights.hpp"
#include "solvers/rounding/switch_limits.hpp"

#include <cstdint>
#include <limits>

namespace solenoid {

/// How much IntegralApproximation may search and remember.
struct IntegralApproximationSettings {
  std::int64_t max_nodes = std::numeric_limits<std::int64_t>::max();
  std::size_t table_entries = 1 << 12;  ///< states remembered as searched; 0: none
};

/// cost and bound in the unit of the grid: bound <= least integral gap of all allowed sequences <= cost.
struct ApproximationReport {
  Status status = Status::numerical_failure;
  double cost = std::numeric_limits<double>::infinity();  ///< integral_gap of the modes found, to rounding
  double bound = 0.0;
  int changes = 0;         ///< of switches, the first against the pattern in force
  std::int64_t nodes = 0;  ///< intervals assigned
  double time_us = 0.0;
};

/// Combinatorial integral approximation by branch and bound (Sager, Jung, Kirches 2011): the allowed mode sequence
/// whose accumulated times are nearest to those of the weights,
///
///     minimise  integral_gap(weights, modes)    over modes[k], k < K, within SwitchLimits  [theory-rounding.md, sect. 3]
///
/// depth first in time, the child of least gap first; of sequences of one gap the first found stays. A node is
/// discarded when its gap so far reaches the incumbent's, when more modes are owed that much time than there are
/// changes left, or when the same accumulated times have been searched from before with no fewer possibilities.
///
/// status    optimal: proven    deadline_reached, iteration_limit: the best found, if cost is finite, with its bound
///           infeasible: no sequence keeps to the limits
///           numerical_failure: weights not normalised, or sizes beyond those prepared for
///
///           Without a sequence found the modes are as they came.
/// promise   no allocation, lock or exception in solve; the first dive ends before the deadline is looked at
class IntegralApproximation {
 public:
  explicit IntegralApproximation(const IntegralApproximationSettings& settings = {}) : settings_(settings) {}

  /// Sizes everything for at most this many intervals, modes and switches. Throws std::invalid_argument.
  void prepare(std::size_t intervals, int modes, int switches);

  /// `modes` comes in as a warm start, used if it keeps to the limits, and leaves as the best found.
  ApproximationReport solve(const ModeWeights& weights, const SwitchLimits& limits, std::span<int> modes,
                            Deadline deadline) noexcept;

 private:
  /// A partial sequence: what the intervals before it have left. Its times by mode and switch are in rows of arrays.
  struct State {
    double gap = 0.0;
    std::int64_t pattern = -1;
    int changes = 0;
    int next = 0, children = 0;  // of its children, sorted, in order_ and child_gap_
  };
  /// A state that has been searched; its times by mode and switch likewise.
  struct Searched {
    std::size_t depth = 0;
    double gap = 0.0;
    std::int64_t pattern = -1;
    int changes = 0;
    std::uint32_t solve = 0;
  };

  bool fits(const ModeWeights& weights, const SwitchLimits& limits, std::span<const int> modes) const noexcept;
  void begin(const ModeWeights& weights, const SwitchLimits& limits) noexcept;
  void adopt(const ModeWeights& weights, const SwitchLimits& limits, std::span<const int> modes) noexcept;
  bool search(const SwitchLimits& limits, std::span<const double> dt, Deadline deadline) noexcept;
  bool stopped(Deadline deadline) noexcept;
  void branch(const SwitchLimits& limits, std::span<const double> dt, std::size_t depth) noexcept;
  bool allowed(const SwitchLimits& limits, std::size_t depth, SwitchPattern next) const noexcept;
  void insert_child(std::size_t depth, int mode, double gap) noexcept;
  void assign(const SwitchLimits& limits, std::span<const double> dt, std::size_t depth, int mode) noexcept;
  bool lacks_changes(const SwitchLimits& limits, std::size_t depth) const noexcept;
  bool searched_before(const SwitchLimits& limits, std::size_t depth) noexcept;
  bool dominated(const SwitchLimits& limits, const Searched& entry, std::size_t row, std::size_t depth) const noexcept;
  void keep(std::size_t depth) noexcept;
  double open_bound(std::size_t depth) const noexcept;

  double* served(std::size_t depth) noexcept { return served_.data() + depth * modes_; }
  const double* served(std::size_t depth) const noexcept { return served_.data() + depth * modes_; }
  const double* due(std::size_t depth) const noexcept { return due_.data() + depth * modes_; }

  IntegralApproximationSettings settings_;
  std::size_t most_intervals_ = 0, most_modes_ = 0, most_switches_ = 0;
  std::size_t intervals_ = 0, modes_ = 0, switches_ = 0;  // of the solve under way
  int least_changes_ = 1;                                 // that a change of mode costs
  std::vector<State> path_;                               // by depth, as are the rows of:
  std::vector<double> time_;                              // when the interval begins
  std::vector<double> due_;                               // each mode's time by the weights until then
  std::vector<double> served_;                            // and by the modes chosen
  std::vector<double> changed_at_;                        // each switch's last change
  std::vector<int> count_;                                // and number of changes
  std::vector<int> order_, chosen_, best_;
  std::vector<double> child_gap_;
  std::vector<Searched> table_;
  std::vector<double> table_served_, table_changed_at_;
  std::vector<int> table_count_;
  std::uint32_t solve_ = 0;  // the number of the solve under way: entries of others are not looked at
  std::size_t depth_ = 0;
  ApproximationReport report_;
};

}  // namespace solenoid
