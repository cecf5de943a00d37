#pragma once

#include <cstdint>

namespace solenoid {

/// Counts the allocations of the calling thread so far: malloc, calloc, realloc, aligned_alloc, operator new, from any
/// library. It counts only in programs that link the CMake target `allocation_hook`; elsewhere the count stays 0 and
/// available() is false.
struct AllocationGuard {
  static bool available();
  static std::int64_t thread_allocations();
};

}  // namespace solenoid
