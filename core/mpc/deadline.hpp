#pragma once

#include <chrono>
#include <cstdint>
#include <limits>

namespace solenoid {

/// A deadline is a moment on the monotonic clock that a solver must not outlast.
class Deadline {
 public:
  using Clock = std::chrono::steady_clock;

  /// No deadline: solve to the end.
  static Deadline never() { return Deadline(Clock::time_point::max()); }
  /// The deadline that comes `budget` from now.
  static Deadline after(std::chrono::nanoseconds budget) {
    const auto now = Clock::now();
    return budget < Clock::time_point::max() - now ? Deadline(now + budget) : never();
  }
  /// The same in seconds: never, if that is beyond the clock.
  static Deadline after_s(double seconds) {
    constexpr double longest_s = 9e9;  // of 2^63 ns
    return seconds < longest_s ? after(std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * seconds))) : never();
  }

  /// The deadline at this moment.
  explicit Deadline(Clock::time_point moment) : moment_(moment) {}
  /// Whether it is time to stop; reads the clock.
  bool passed() const { return moment_ != Clock::time_point::max() && Clock::now() >= moment_; }
  /// Returns the deadline that comes after `part` of the time that is left to this one.
  Deadline share(double part) const {
    const auto now = Clock::now();
    if (moment_ == Clock::time_point::max() || moment_ <= now) return *this;
    return Deadline(now + std::chrono::duration_cast<Clock::duration>(part * (moment_ - now)));
  }
  /// Returns the time that is left [s], infinity without a deadline.
  double seconds_left() const {
    if (moment_ == Clock::time_point::max()) return std::numeric_limits<double>::infinity();
    return std::chrono::duration<double>(moment_ - Clock::now()).count();
  }

 private:
  Clock::time_point moment_;
};

/// Returns the time since a moment on the same clock [us].
inline double us_since(Deadline::Clock::time_point moment) noexcept {
  return std::chrono::duration<double, std::micro>(Deadline::Clock::now() - moment).count();
}

}  // namespace solenoid
