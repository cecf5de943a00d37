#pragma once

#include <chrono>
#include <cstddef>
#include <functional>

#include <sched.h>

namespace solenoid::bench {

/// Of the wall's clock.
inline double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// From now on this process runs on one core alone.
inline void pin_to_core(std::size_t core) {
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(core, &one);
  sched_setaffinity(0, sizeof one, &one);
}

}  // namespace solenoid::bench
