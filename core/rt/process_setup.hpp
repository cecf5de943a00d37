#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace solenoid {

/// What the operating system was asked for and said.
struct SetupStep {
  std::string what;
  bool granted = false;
  std::string detail;  ///< what was granted, or why not and what would permit it
};

/// Locks present and future memory, touches `heap_bytes` of heap and keeps them, so that nothing faults later. Once a
/// process, before its threads start.
SetupStep lock_memory(std::size_t heap_bytes = 64u << 20);

/// SCHED_FIFO for the calling thread.
SetupStep set_fifo_priority(const char* who, int priority);

/// Keeps the calling thread on one core.
SetupStep pin_to_core(const char* who, int core);

/// Wake-ups of the calling thread as exact as the kernel can, without SCHED_FIFO; its stack touched; signals left to
/// other threads.
void prepare_thread(const char* name) noexcept;

/// Cores this process may run on, in order.
std::vector<int> usable_cores();

}  // namespace solenoid
