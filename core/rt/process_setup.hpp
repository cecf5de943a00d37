#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace solenoid {

/// A step of the set-up records what the operating system was asked for and what it said.
struct SetupStep {
  std::string what;
  bool granted = false;
  std::string detail;  ///< what was granted, or why not and what would permit it
};

/// Locks present and future memory, touches `heap_bytes` of heap and keeps them, so that nothing faults later. To be
/// called once a process, before its threads start.
SetupStep lock_memory(std::size_t heap_bytes = 64u << 20);

/// Asks for SCHED_FIFO for the calling thread, which messages call `who`.
SetupStep set_fifo_priority(const char* who, int priority);

/// Keeps the calling thread on one core.
SetupStep pin_to_core(const char* who, int core);

/// Makes the calling thread's wake-ups as exact as the kernel can without SCHED_FIFO, touches its stack, and leaves
/// signals to other threads.
void prepare_thread(const char* name) noexcept;

/// Returns the cores that this process may run on, in order.
std::vector<int> usable_cores();

}  // namespace solenoid
