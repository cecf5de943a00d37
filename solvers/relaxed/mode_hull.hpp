#pragma once

#include "core/mpc/mode_set.hpp"

#include <span>
#include <vector>

#include <Eigen/Core>

namespace solenoid {

/// The convex hull of a mode set's patterns as a product of simplices, found from the patterns: the switches fall into
/// the smallest groups that choose independently of each other, and the patterns of a group are a simplex's corners.
///
///     c = offset + gain v,   v >= 0,   sums v <= 1                                        [theory-relaxed.md, eq. 6]
///
/// with v the weights of each group's corners but its first. `three_way` and one free switch a group: v is c, a box;
/// `two_way`: two weights a chamber, fill + exhaust <= 1. The weight of a mode is the product of its corners' weights.
/// shapes   offset: switches   gain: switches x weights   sums: one row a group of two weights or more
class ModeHull {
 public:
  ModeHull() = default;
  explicit ModeHull(const ModeSet& modes);

  int weights() const { return static_cast<int>(gain.cols()); }
  /// v of a row of mode weights: the marginals of the groups.
  void marginals(std::span<const double> mode_weights, double* v) const noexcept;
  /// A row of mode weights of v; nonnegative with sum 1 for every v, those outside the hull moved into it.
  void mode_weights(const double* v, std::span<double> weights) const noexcept;
  /// Rows R of v that tell all that `offset + gain v` can: `sums`, then as many switches' rows of `gain` as are
  /// independent of them and of each other.
  Eigen::MatrixXd independent_rows() const;
  /// The matrix that gives the switch states back from what is remembered of v: gain v = recall(R) R v.
  Eigen::MatrixXd recall(const Eigen::MatrixXd& rows) const;

  Eigen::VectorXd offset;
  Eigen::MatrixXd gain, sums;

 private:
  struct Group {
    int first = 0;  ///< of its weights in v
    std::vector<SwitchPattern> corners;
  };
  std::vector<Group> groups_;
  std::vector<std::vector<int>> corner_;  ///< of each mode in each group
};

}  // namespace solenoid
