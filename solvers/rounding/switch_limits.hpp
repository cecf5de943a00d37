#pragma once

#include "core/mpc/mode_set.hpp"

#include <limits>
#include <span>
#include <vector>

namespace solenoid {

/// What a rounded mode sequence must keep to. A mode is a pattern of switches. Times in the unit of the grid.
struct SwitchLimits {
  static constexpr int unlimited = std::numeric_limits<int>::max();
  static constexpr std::size_t most_switches = 32;
  static constexpr double long_ago = std::numeric_limits<double>::infinity();
  /// One switch: once on it stays on for min_on, once off it stays off for min_off.
  struct PerSwitch {
    double min_on = 0.0, min_off = 0.0;
    int max_changes = unlimited;
    double age = long_ago;  ///< since its last change, when the grid begins
  };

  std::vector<SwitchPattern> patterns;  ///< of each mode
  std::vector<PerSwitch> switches;
  int max_changes = unlimited;               ///< of all switches together
  std::vector<SwitchPattern> one_at_a_time;  ///< groups of which at most one switch changes between two intervals
  /// The pattern in force when the grid begins; -1: none, the first mode is free of charge and dwell.
  std::int64_t in_force = -1;

  /// Whether any number of changes is limited.
  bool counts_changes() const noexcept;
};

/// No limits on `modes` modes, each a switch of its own: a change of mode turns one off and another on.
SwitchLimits one_hot_limits(int modes);

/// The patterns of a mode set with its dwell times and groups, in model steps, after the commands in `lines`.
SwitchLimits mode_set_limits(const ModeSet& modes, const SwitchTiming& timing, const DelayLines& lines);
/// Of limits that come from there, lets the grid begin after the commands in `lines`. What windows have left of their
/// changes is all that the grid gets: a grid longer than a window could have more.
void begin_after(const SwitchTiming& timing, const DelayLines& lines, SwitchLimits& limits) noexcept;

/// Whether `age` is a dwell of `least`, in spite of rounding.
inline bool has_dwelt(double age, double least) noexcept { return age >= least * (1.0 - 1e-9); }

/// Whether a sequence kept to the limits, and its switch changes.
struct LimitedWalk {
  bool allowed = true;
  int changes = 0;
};
/// Walks a sequence through the limits.
LimitedWalk walk_limits(const SwitchLimits& limits, std::span<const double> dt, std::span<const int> modes) noexcept;

}  // namespace solenoid
