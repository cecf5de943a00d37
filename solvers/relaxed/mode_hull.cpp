#include "solvers/relaxed/mode_hull.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <functional>
#include <numeric>

#include <Eigen/Dense>

namespace solenoid {
namespace {

/// The different patterns of the modes on some switches, ascending.
std::vector<SwitchPattern> projected(const ModeSet& modes, SwitchPattern onto) {
  std::vector<SwitchPattern> seen;
  for (const Mode& mode : modes.modes()) seen.push_back(mode.pattern & onto);
  std::ranges::sort(seen);
  seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
  return seen;
}

bool independent(const ModeSet& modes, SwitchPattern a, SwitchPattern b) {
  return projected(modes, a).size() * projected(modes, b).size() == projected(modes, a | b).size();
}

/// `left` cut into the smallest sets of switches no two of which depend on each other one switch by one. Whatever is
/// independent of the rest is a union of them; a set of many switches is thus a matter of few.
std::vector<SwitchPattern> pairwise_parts(const ModeSet& modes, SwitchPattern left) {
  std::vector<SwitchPattern> parts;
  for (; left != 0; left &= left - 1) {
    SwitchPattern joined = left & (~left + 1);
    const auto depends = [&](SwitchPattern part) {
      for (SwitchPattern some = part; some != 0; some &= some - 1)
        if (!independent(modes, some & (~some + 1), left & (~left + 1))) return true;
      return false;
    };
    const auto kept = std::partition(parts.begin(), parts.end(), [&](SwitchPattern part) { return !depends(part); });
    joined = std::accumulate(kept, parts.end(), joined, std::bit_or<>());
    parts.erase(kept, parts.end());
    parts.push_back(joined);
  }
  return parts;
}

constexpr std::size_t most_parts = 16;  // whose unions are tried one by one

/// The smallest set of switches with the lowest of `left` that is independent of the rest of `left`; of very many parts all.
SwitchPattern smallest_factor(const ModeSet& modes, SwitchPattern left) {
  const SwitchPattern lowest = left & (~left + 1);
  const std::vector<SwitchPattern> parts = pairwise_parts(modes, left);
  SwitchPattern best = left;
  if (parts.size() > most_parts) return best;
  for (std::uint64_t choice = 1; choice < (std::uint64_t{1} << parts.size()); ++choice) {
    SwitchPattern some = 0;
    for (std::size_t i = 0; i < parts.size(); ++i)
      if ((choice >> i) & 1u) some |= parts[i];
    if ((some & lowest) != 0 && std::popcount(some) < std::popcount(best) && independent(modes, some, left & ~some))
      best = some;
  }
  return best;
}

}  // namespace

ModeHull::ModeHull(const ModeSet& modes) : corner_(static_cast<std::size_t>(modes.size())) {
  const int switches = modes.switch_count();
  int weights = 0, sum_rows = 0;
  for (SwitchPattern left = first_switches(static_cast<std::size_t>(switches)); left != 0;) {
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
