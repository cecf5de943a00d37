#pragma once

#include "core/rt/io.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace solenoid {

/// These rates say how fast commands may change. Nothing holds back a change to the safe state.
struct CommandRates {
  double motor_n_per_tick = std::numeric_limits<double>::infinity();
  int coil_period_ticks = 0;  ///< least time from one switching-on of a coil to its next
};

/// Every command leaves through this one exit, which sees that it is finite, in range, an allowed pattern and no faster
/// than the rates. What it refuses it replaces by the safe value (coils off, motor 0 N) or clamps, and counts.
class CommandLimits {
 public:
  /// Allows the mode set's patterns and forces up to the motor's limit.
  CommandLimits(const ModeSet& modes, double motor_limit_n, CommandRates rates = {})
      : motor_limit_n_(motor_limit_n), rates_(rates) {
    for (const Mode& mode : modes.modes()) allowed_ |= std::uint64_t{1} << (mode.pattern % 64);
    since_on_.fill(DelayLines::max_age);
  }

  /// Changes the rates from the next command on.
  void set_rates(const CommandRates& rates) noexcept { rates_ = rates; }

  /// What may leave in place of the wanted command, once a tick.
  Command checked(const Command& wanted) noexcept {
    Command safe;
    if (wanted.coils < 64 && ((allowed_ >> wanted.coils) & 1u))
      safe.coils = held(wanted.coils);
    else
      ++refused_;
    if (!std::isfinite(wanted.motor_force_n))
      ++refused_;
    else
      safe.motor_force_n = limited(std::clamp(wanted.motor_force_n, -motor_limit_n_, motor_limit_n_));
    for (std::size_t c = 0; c < since_on_.size(); ++c)
      since_on_[c] = ((safe.coils & ~last_.coils) >> c) & 1u ? 0 : std::min(since_on_[c] + 1, DelayLines::max_age);
    last_ = safe;
    return safe;
  }

  /// Values replaced by the safe one since the start.
  std::int64_t refused() const { return refused_; }
  std::int64_t slowed() const { return slowed_; }  ///< commands that the rates changed

 private:
  /// Coils that would be switched on again too soon stay off; the rest must still be an allowed pattern.
  SwitchPattern held(SwitchPattern wanted) noexcept {
    if (rates_.coil_period_ticks == 0) return wanted;
    SwitchPattern kept = wanted;
    for (std::size_t c = 0; c < since_on_.size(); ++c)
      if (((wanted & ~last_.coils) >> c) & 1u)
        if (since_on_[c] + 1 < rates_.coil_period_ticks) kept &= ~(SwitchPattern{1} << c);
    if (kept == wanted) return wanted;
    ++slowed_;
    return (allowed_ >> kept) & 1u ? kept : 0;
  }

  double limited(double force_n) noexcept {
    const double from = last_.motor_force_n, most = rates_.motor_n_per_tick;
    const double kept = std::clamp(force_n, std::min(from - most, 0.0), std::max(from + most, 0.0));
    if (kept != force_n) ++slowed_;
    return kept;
  }

  std::uint64_t allowed_ = 0;
  double motor_limit_n_;
  CommandRates rates_;
  Command last_;
  std::array<int, max_switches> since_on_{};
  std::int64_t refused_ = 0, slowed_ = 0;
};

}  // namespace solenoid
