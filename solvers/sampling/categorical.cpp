#include "solvers/sampling/categorical.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace solenoid {
namespace {

constexpr double full_column = 4294967296.0;  // 2^32

}  // namespace

void CategoricalBlocks::prepare(std::size_t blocks, std::size_t modes) {
  blocks_ = blocks;
  modes_ = modes;
  probability_.assign(blocks * modes, 1.0 / static_cast<double>(modes));
  threshold_.resize(blocks * modes);
  alias_.resize(blocks * modes);
  height_.resize(modes);
  low_.resize(modes);
  high_.resize(modes);
  tabulate();
}

void CategoricalBlocks::tabulate() noexcept {
  for (std::size_t block = 0; block < blocks_; ++block) {
    const std::span<double> p = row(block);
    const double sum = std::accumulate(p.begin(), p.end(), 0.0);
    const bool proper = std::isfinite(sum) && sum > 0.0 && *std::ranges::min_element(p) >= 0.0;
    for (double& x : p) x = proper ? x / sum : 1.0 / static_cast<double>(modes_);
    tabulate(block);
  }
}

/// Columns of equal width, one a mode, filled to their mean: what a low column lacks comes from a high one, its alias.
void CategoricalBlocks::tabulate(std::size_t block) noexcept {
  const std::span<const double> p = row(block);
  std::size_t lows = 0, highs = 0;
  for (std::size_t m = 0; m < modes_; ++m) {
    height_[m] = p[m] * static_cast<double>(modes_);
    (height_[m] < 1.0 ? low_[lows++] : high_[highs++]) = m;
  }
  const auto close = [&](std::size_t column, double height, std::size_t alias) {
    threshold_[block * modes_ + column] = static_cast<std::uint64_t>(height * full_column);
    alias_[block * modes_ + column] = static_cast<int>(alias);
  };
  while (lows > 0 && highs > 0) {
    const std::size_t low = low_[--lows], high = high_[highs - 1];
    close(low, height_[low], high);
    height_[high] -= 1.0 - height_[low];
    if (height_[high] >= 1.0) continue;
    --highs;
    low_[lows++] = high;
  }
  while (lows > 0) close(low_[lows - 1], 1.0, low_[lows - 1]), --lows;  // by rounding alone
  while (highs > 0) close(high_[highs - 1], 1.0, high_[highs - 1]), --highs;
}

}  // namespace solenoid
