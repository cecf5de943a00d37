#pragma once

#include "core/mpc/deadline.hpp"

#include <algorithm>

#include <time.h>

namespace solenoid {

/// Time of the work in between, on the wall's clock, less what the thread was kept from its core: the processor's clock
/// is read outside of the wall's, since it is the slower one, and is the smaller only where the thread had to wait.
class Stopwatch {
 public:
  Stopwatch() : processor_us_(thread_us()), begin_(Deadline::Clock::now()) {}
  /// Since it was made [us].
  double us() const {
    const double wall_us = us_since(begin_);
    return std::min(wall_us, thread_us() - processor_us_);
  }

 private:
  /// Processor time of this thread.
  static double thread_us() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
  }

  double processor_us_;
  Deadline::Clock::time_point begin_;
};

}  // namespace solenoid
