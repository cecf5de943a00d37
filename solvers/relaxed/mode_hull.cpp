#include "solvers/relaxed/mode_hull.hpp"

#include <algorithm>
#include <bit>
#include <set>

#include <Eigen/Dense>

namespace solenoid {
namespace {

std::vector<SwitchPattern> projected(const ModeSet& modes, SwitchPattern onto) {
  std::set<SwitchPattern> seen;
  for (const Mode& mode : modes.modes()) seen.insert(mode.pattern & onto);
  return {seen.begin(), seen.end()};
}

/// The smallest set of switches with the lowest of `left` that is independent of the rest of `left`.
SwitchPattern smallest_factor(const ModeSet& modes, SwitchPattern left) {
  const SwitchPattern lowest = left & (~left + 1);
  const std::size_t all = projected(modes, left).size();
  SwitchPattern best = left;
  for (SwitchPattern some = left; some != 0; some = (some - 1) & left)
    if ((some & lowest) != 0 && std::popcount(some) < std::popcount(best) &&
        projected(modes, some).size() * projected(modes, left & ~some).size() == all)
      best = some;
  return best;
}

}  // namespace

ModeHull::ModeHull(const ModeSet& modes) : corner_(static_cast<std::size_t>(modes.size())) {
  const int switches = modes.switch_count();
  int weights = 0, sum_rows = 0;
  for (SwitchPattern left = (SwitchPattern{1} << switches) - 1; left != 0;) {
    const SwitchPattern factor = smallest_factor(modes, left);
    Group group{weights, projected(modes, factor)};
    for (int m = 0; m < modes.size(); ++m) {
      const auto at = std::find(group.corners.begin(), group.corners.end(), modes.pattern(m) & factor);
      corner_[static_cast<std::size_t>(m)].push_back(static_cast<int>(at - group.corners.begin()));
    }
    weights += static_cast<int>(group.corners.size()) - 1;
    sum_rows += group.corners.size() > 2;
    groups_.push_back(std::move(group));
    left &= ~factor;
  }
  offset.setZero(switches);
  gain.setZero(switches, weights);
  sums.setZero(sum_rows, weights);
  int row = 0;
  for (const Group& group : groups_) {
    const auto bit = [](SwitchPattern pattern, int c) { return static_cast<double>((pattern >> c) & 1u); };
    const auto free = static_cast<Eigen::Index>(group.corners.size()) - 1;
    for (int c = 0; c < switches; ++c) {
      offset[c] += bit(group.corners[0], c);
      for (Eigen::Index i = 0; i < free; ++i)
        gain(c, group.first + i) = bit(group.corners[static_cast<std::size_t>(i) + 1], c) - bit(group.corners[0], c);
    }
    if (free > 1) sums.row(row++).segment(group.first, free).setOnes();
  }
}

void ModeHull::marginals(std::span<const double> mode_weights, double* v) const noexcept {
  std::fill_n(v, weights(), 0.0);
  for (std::size_t m = 0; m < mode_weights.size(); ++m)
    for (std::size_t g = 0; g < groups_.size(); ++g)
      if (corner_[m][g] > 0) v[groups_[g].first + corner_[m][g] - 1] += mode_weights[m];
}

void ModeHull::mode_weights(const double* v, std::span<double> weights) const noexcept {
  std::fill(weights.begin(), weights.end(), 1.0);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const double* own = v + groups_[g].first;
    const std::size_t free = groups_[g].corners.size() - 1;
    double sum = 0.0;
    for (std::size_t i = 0; i < free; ++i) sum += std::clamp(own[i], 0.0, 1.0);
    const double shrink = sum > 1.0 ? 1.0 / sum : 1.0;
    const double rest = sum > 1.0 ? 0.0 : 1.0 - sum;
    for (std::size_t m = 0; m < weights.size(); ++m) {
      const int corner = corner_[m][g];
      weights[m] *= corner == 0 ? rest : shrink * std::clamp(own[corner - 1], 0.0, 1.0);
    }
  }
}

Eigen::MatrixXd ModeHull::independent_rows() const {
  Eigen::MatrixXd rows = sums;
  for (Eigen::Index c = 0; c < gain.rows(); ++c) {
    Eigen::MatrixXd more(rows.rows() + 1, gain.cols());
    more << rows, gain.row(c);
    if (more.fullPivLu().rank() == more.rows()) rows = more;
  }
  return rows;
}

Eigen::MatrixXd ModeHull::recall(const Eigen::MatrixXd& rows) const {
  return gain * rows.completeOrthogonalDecomposition().pseudoInverse();
}

}  // namespace solenoid
