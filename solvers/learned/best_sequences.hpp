#pragma once

#include "solvers/search/tree_nodes.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

namespace solenoid {

/// The sequences of the highest sums of scores, a score for each mode in each block.
///
/// Of the K best of b + 1 blocks, one whose first b blocks are the i-th best and whose last mode is the j-th best, both
/// counted from 1, has at least i j - 1 better ones: so i j <= K, and few have to be looked at.
class BestSequences {
 public:
  static constexpr int most = 32;  ///< that can be asked for

  /// The k best, best first; of equal ones that which was found first.
  /// shapes   scores: blocks x modes, block-major, at least one mode    into: k <= most
  /// Returns how many there are, at most k. No allocation.
  int find(std::span<const float> scores, std::size_t blocks, std::span<ModeSequence> into) noexcept {
    const std::size_t modes = scores.size() / blocks;
    k_ = std::min<std::size_t>(into.size(), most);
    if (k_ == 0) return 0;
    std::size_t count = 1;
    sums_[0] = 0.0f;
    for (std::size_t b = 0; b < blocks; ++b) {
      const std::size_t ranked = rank(scores.subspan(b * modes, modes));
      std::copy_n(sums_.begin(), count, sums_before_.begin());
      const std::size_t prefixes = count;
      count = 0;
      for (std::size_t i = 0; i < prefixes; ++i)
        for (std::size_t j = 0; j < ranked && (i + 1) * (j + 1) <= k_; ++j) {
          const float sum = sums_before_[i] + mode_score_[j];
          if (count == k_ && !(sum > sums_[k_ - 1])) break;  // nor is any with a worse mode
          count = insert(steps_[b], sum, {static_cast<std::uint16_t>(i), mode_[j]}, count);
        }
    }
    for (std::size_t i = 0; i < count; ++i) {
      into[i] = {};
      std::size_t at = i;
      for (std::size_t b = blocks; b-- > 0; at = steps_[b][at].before) into[i][b] = steps_[b][at].mode;
    }
    return static_cast<int>(count);
  }

 private:
  /// The last mode of one of a block's best sequences, and which of the best of the blocks before it follows.
  struct Step {
    std::uint16_t before = 0, mode = 0;
  };
  using Steps = std::array<Step, most>;

  /// Finds the best modes of a block, at most k, best first.
  std::size_t rank(std::span<const float> scores) noexcept {
    std::size_t count = 0;
    for (std::size_t mode = 0; mode < scores.size(); ++mode) {
      if (count == k_ && !(scores[mode] > mode_score_[count - 1])) continue;
      std::size_t at = count < k_ ? count++ : count - 1;
      for (; at > 0 && scores[mode] > mode_score_[at - 1]; --at) {
        mode_score_[at] = mode_score_[at - 1];
        mode_[at] = mode_[at - 1];
      }
      mode_score_[at] = scores[mode];
      mode_[at] = static_cast<std::uint16_t>(mode);
    }
    return count;
  }

  /// Puts a sequence where it belongs; returns how many there are then.
  std::size_t insert(Steps& steps, float sum, Step step, std::size_t count) noexcept {
    std::size_t at = count < k_ ? count++ : count - 1;
    for (; at > 0 && sum > sums_[at - 1]; --at) {
      sums_[at] = sums_[at - 1];
      steps[at] = steps[at - 1];
    }
    sums_[at] = sum;
    steps[at] = step;
    return count;
  }

  std::array<Steps, max_tree_blocks> steps_{};
  std::array<float, most> sums_{}, sums_before_{}, mode_score_{};
  std::array<std::uint16_t, most> mode_{};
  std::size_t k_ = 0;
};

}  // namespace solenoid
