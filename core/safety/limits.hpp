#pragma once

#include "core/rt/io.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace solenoid {

/// The one exit of every command: finite, in range, an allowed pattern. What is refused is replaced by its safe value
/// (coils off, motor 0 N) or clamped, and counted.
class CommandLimits {
 public:
  CommandLimits(const ModeSet& modes, double motor_limit_n) : motor_limit_n_(motor_limit_n) {
    for (const Mode& mode : modes.modes()) allowed_ |= std::uint64_t{1} << (mode.pattern % 64);
  }

  Command checked(const Command& wanted) noexcept {
    Command safe;
    if (wanted.coils < 64 && ((allowed_ >> wanted.coils) & 1u))
      safe.coils = wanted.coils;
    else
      ++refused_;
    if (!std::isfinite(wanted.motor_force_n))
      ++refused_;
    else
      safe.motor_force_n = std::clamp(wanted.motor_force_n, -motor_limit_n_, motor_limit_n_);
    return safe;
  }

  std::int64_t refused() const { return refused_; }

 private:
  std::uint64_t allowed_ = 0;
  double motor_limit_n_;
  std::int64_t refused_ = 0;
};

}  // namespace solenoid
