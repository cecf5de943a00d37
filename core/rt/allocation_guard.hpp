#pragma once

#include <cstdint>

namespace solenoid {

/// Allocations made by the calling thread so far: malloc, calloc, realloc, aligned_alloc, operator new, from any
/// library. Counts only in programs that link the CMake target `allocation_hook`; elsewhere it stays 0 and available()
/// is false.
struct AllocationGuard {
  static bool available();
  static std::int64_t thread_allocations();
};

}  // namespace solenoid
