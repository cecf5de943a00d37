#pragma once

#include "experiments/report/run_table.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace solenoid {

/// Judged errors of a table's runs side by side: a row a task, which is a scenario with a seed, a column a variant.
///
///     error   T x V, of the variants of the table; T tasks that any of them ran, those of a scenario together
///
/// The order of tasks depends on the names of scenarios and on seeds, not on the order in which runs came.
class TaskErrors {
 public:
  /// Of all runs, or of those in a group.
  explicit TaskErrors(const RunTable& runs, std::optional<std::uint32_t> group = {});

  std::size_t tasks() const { return scenario_.size(); }
  std::size_t variants() const { return variants_; }
  std::size_t scenarios() const { return scenarios_; }
  /// Number of a task's scenario, not decreasing.
  std::size_t scenario(std::size_t task) const { return scenario_[task]; }
  bool ran(std::size_t task, std::size_t variant) const { return errors_[task * variants_ + variant] >= 0; }
  /// Whether it ran and ended well.
  bool ok(std::size_t task, std::size_t variant) const { return errors_[task * variants_ + variant] > 0; }
  /// Of a run that ended well.
  double error(std::size_t task, std::size_t variant) const { return errors_[task * variants_ + variant]; }

 private:
  std::size_t variants_, scenarios_ = 0;
  std::vector<std::uint32_t> scenario_;  // of a task
  std::vector<double> errors_;           // 0: it did not end well, -1: it did not run
};

}  // namespace solenoid
