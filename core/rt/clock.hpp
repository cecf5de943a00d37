#pragma once

#include <cerrno>
#include <cmath>
#include <ctime>

namespace solenoid {

/// Simulated time: a sleep is a jump. The executive's clock in simulation and in tests.
class FakeClock {
 public:
  double now_s() const { return now_s_; }
  void sleep_until(double time_s) {
    if (time_s > now_s_) now_s_ = time_s;
  }

 private:
  double now_s_ = 0.0;
};

/// CLOCK_MONOTONIC in seconds since the object was made: no step of the wall clock reaches it. Sleeps are absolute, so
/// their lateness does not add up, and a signal does not shorten them.
class MonotonicClock {
 public:
  MonotonicClock() : origin_(moment()) {}

  double now_s() const noexcept { return seconds_since(origin_, moment()); }
  void sleep_until(double time_s) noexcept {
    if (!(time_s > 0.0)) return;
    const double whole = std::floor(time_s);
    timespec until{origin_.tv_sec + static_cast<time_t>(whole),
                   origin_.tv_nsec + static_cast<long>(1e9 * (time_s - whole))};
    if (until.tv_nsec >= 1'000'000'000) {
      until.tv_nsec -= 1'000'000'000;
      ++until.tv_sec;
    }
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
    }
  }

 private:
  static timespec moment() noexcept {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t;
  }
  static double seconds_since(const timespec& from, const timespec& to) noexcept {
    return static_cast<double>(to.tv_sec - from.tv_sec) + 1e-9 * static_cast<double>(to.tv_nsec - from.tv_nsec);
  }

  timespec origin_;
};

}  // namespace solenoid
