#pragma once

#include "core/signal/mixed_bits.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace solenoid {

/// Independent distributions over the modes, one a block, that can be drawn from in constant time: the alias method
/// (M. D. Vose, IEEE Trans. Software Engineering 17(9), 972-975, 1991).
class CategoricalBlocks {
 public:
  /// Makes room. Allocates.
  void prepare(std::size_t blocks, std::size_t modes);

  /// The probabilities, blocks x modes, block-major: to be written, then made ready for draws by tabulate().
  std::span<double> probabilities() noexcept { return probability_; }
  /// The same, to be read.
  std::span<const double> probabilities() const noexcept { return probability_; }
  /// One block's.
  std::span<double> row(std::size_t block) noexcept { return std::span(probability_).subspan(block * modes_, modes_); }
  /// Makes draws follow the probabilities, each row divided by its sum first. A row without a positive finite sum becomes
  /// uniform.
  void tabulate() noexcept;

  /// The mode that 64 random bits stand for.
  int draw(std::size_t block, std::uint64_t bits) const noexcept {
    const std::uint64_t scaled = (bits >> 32) * modes_;  // the column, and in the lower half where inside it
    const std::size_t column = block * modes_ + static_cast<std::size_t>(scaled >> 32);
    return (scaled & 0xffffffffu) < threshold_[column] ? static_cast<int>(scaled >> 32) : alias_[column];
  }

 private:
  void tabulate(std::size_t block) noexcept;

  std::size_t blocks_ = 0, modes_ = 0;
  std::vector<double> probability_;
  std::vector<std::uint64_t> threshold_;  // of 2^32: draws of a column below it are the column's own mode
  std::vector<int> alias_;
  std::vector<double> height_;           // of a block's columns while its table is made
  std::vector<std::size_t> low_, high_;  // columns below and above the mean
};

/// Random bits, the same on every machine: SplitMix64.
class RandomBits {
 public:
  /// The sequence of this seed.
  explicit RandomBits(std::uint64_t seed) : state_(seed) {}
  /// The next 64.
  std::uint64_t next() noexcept {
    const std::uint64_t bits = mixed_bits(state_);
    state_ += 0x9e3779b97f4a7c15u;
    return bits;
  }
  /// A number from 0 to n - 1, n < 2^32.
  std::uint32_t below(std::uint32_t n) noexcept { return static_cast<std::uint32_t>(((next() >> 32) * n) >> 32); }

 private:
  std::uint64_t state_;
};

}  // namespace solenoid
