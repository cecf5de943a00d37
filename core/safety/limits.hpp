#pragma once

#include "core/rt/io.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace solenoid {

/// These rates say how fast commands may change. Nothing holds back a change to the safe state, planned or not.
struct CommandRates {
  double continuous_per_tick = std::numeric_limits<double>::infinity();  ///< of each continuous input
  int switch_period_ticks = 0;  ///< least time from one switching-on of a switch to its next
};

/// Every command leaves through this one exit, which sees that it is finite, in range, an allowed pattern and, but for the
/// safe pattern, no faster than the rates. What it refuses it replaces by the safe value (the safe pattern, input 0) or
/// clamps, and counts.
class CommandLimits {
 public:
  /// Allows the mode set's patterns, and of each continuous input magnitudes up to its limit.
  CommandLimits(const ModeSet& modes, const std::vector<double>& magnitudes)
      : modes_(modes), safe_(modes.safe_pattern()) {
    std::copy_n(magnitudes.begin(), std::min(magnitudes.size(), most_.size()), most_.begin());
    since_on_.fill(DelayLines::max_age);
  }

  /// Changes the rates from the next command on.
  void set_rates(const CommandRates& rates) noexcept { rates_ = rates; }

  /// From now on allows only modes of these, too, which outlive it, and has their safe pattern; nullptr: no change.
  void restrict_to(const ModeSet* left) noexcept {
    if (!left || left == left_) return;
    left_ = left;
    safe_ = left->safe_pattern();
  }

  /// What may leave in place of the wanted command, once a tick.
  Command checked(const Command& wanted) noexcept {
    Command left = safe_command();
    if (allowed(wanted.switches))
      left.switches = held(wanted.switches);
    else
      ++refused_;
    for (std::size_t i = 0; i < most_.size(); ++i)
      if (!std::isfinite(wanted.continuous[i]))
        ++refused_;
      else
        left.continuous[i] = limited(std::clamp(wanted.continuous[i], -most_[i], most_[i]), last_.continuous[i]);
    for (std::size_t c = 0; c < since_on_.size(); ++c)
      since_on_[c] =
          ((left.switches & ~last_.switches) >> c) & 1u ? 0 : std::min(since_on_[c] + 1, DelayLines::max_age);
    last_ = left;
    return left;
  }

  /// What is left standing where nothing else may be.
  Command safe_command() const { return {safe_, {}}; }

  /// Values replaced by the safe one since the start.
  std::int64_t refused() const { return refused_; }
  std::int64_t slowed() const { return slowed_; }  ///< commands that the rates changed

 private:
  bool allowed(SwitchPattern pattern) const noexcept {
    return modes_.find(pattern) >= 0 && (!left_ || left_->find(pattern) >= 0);
  }

  /// Switches that would be switched on again too soon stay off; the rest must still be an allowed pattern.
  SwitchPattern held(SwitchPattern wanted) noexcept {
    if (rates_.switch_period_ticks == 0 || wanted == safe_) return wanted;
    SwitchPattern kept = wanted;
    for (std::size_t c = 0; c < since_on_.size(); ++c)
      if (((wanted & ~last_.switches) >> c) & 1u)
        if (since_on_[c] + 1 < rates_.switch_period_ticks) kept &= ~(SwitchPattern{1} << c);
    if (kept == wanted) return wanted;
    ++slowed_;
    return allowed(kept) ? kept : safe_;
  }

  double limited(double value, double from) noexcept {
    const double most = rates_.continuous_per_tick;
    const double kept = std::clamp(value, std::min(from - most, 0.0), std::max(from + most, 0.0));
    if (kept != value) ++slowed_;
    return kept;
  }

  ModeSet modes_;
  const ModeSet* left_ = nullptr;
  ContinuousValues most_{};
  CommandRates rates_;
  SwitchPattern safe_;
  Command last_{safe_, {}};
  std::array<int, max_switches> since_on_{};
  std::int64_t refused_ = 0, slowed_ = 0;
};

}  // namespace solenoid
