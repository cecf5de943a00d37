#include "core/rt/allocation_guard.hpp"

// Weak stand-ins; core/rt/allocation_hook.cpp defines the real ones in the programs that link it.
extern "C" {
__attribute__((weak)) std::int64_t solenoid_thread_allocations() { return 0; }
__attribute__((weak)) bool solenoid_allocation_hook_linked() { return false; }
}

namespace solenoid {

bool AllocationGuard::available() { return solenoid_allocation_hook_linked(); }
std::int64_t AllocationGuard::thread_allocations() { return solenoid_thread_allocations(); }

}  // namespace solenoid
