#pragma once

#include "core/mpc/mode_set.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <numeric>
#include <vector>

namespace solenoid {

/// How many switches change between two modes, looked up. A row is the mode in force before; one row more, start_row(), is the
/// pattern that a search starts from, which need not be a mode.
class SwitchChanges {
 public:
  /// Fills the rows of the modes. Allocates.
  void prepare(const ModeSet& modes) {
    modes_ = static_cast<std::size_t>(modes.size());
    changes_.resize((modes_ + 1) * modes_);
    within_.resize((modes_ + 1) * (max_switches + 1));
    for (int mode = 0; mode < modes.size(); ++mode) fill(modes, static_cast<std::size_t>(mode), modes.pattern(mode));
  }

  /// Fills start_row().
  void start_from(const ModeSet& modes, SwitchPattern pattern) noexcept { fill(modes, modes_, pattern); }
  /// The row of the pattern that start_from() was told.
  std::size_t start_row() const noexcept { return modes_; }

  /// Switch changes from a row to a mode.
  int between(std::size_t row, int mode) const noexcept {
    return changes_[row * modes_ + static_cast<std::size_t>(mode)];
  }
  /// Modes that `changes` changes at most lead to.
  int modes_within(std::size_t row, int changes) const noexcept {
    return within_[row * (max_switches + 1) + static_cast<std::size_t>(changes)];
  }

 private:
  void fill(const ModeSet& modes, std::size_t row, SwitchPattern before) noexcept {
    int* within = &within_[row * (max_switches + 1)];
    std::fill_n(within, max_switches + 1, 0);
    for (std::size_t mode = 0; mode < modes_; ++mode) {
      const int changes = std::popcount(before ^ modes.pattern(static_cast<int>(mode)));
      changes_[row * modes_ + mode] = static_cast<std::uint8_t>(changes);
      ++within[changes];
    }
    std::partial_sum(within, within + max_switches + 1, within);
  }

  std::size_t modes_ = 0;
  std::vector<std::uint8_t> changes_;  // [row][mode]
  std::vector<int> within_;            // [row][changes]
};

}  // namespace solenoid
