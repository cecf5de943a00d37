#include "core/rt/process_setup.hpp"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include <fmt/format.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

namespace solenoid {
namespace {

/// Freed memory stays with the process, and so stays mapped and locked.
void touch_heap(std::size_t bytes) {
  mallopt(M_TRIM_THRESHOLD, -1);
  mallopt(M_MMAP_MAX, 0);
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  auto* memory = static_cast<volatile char*>(std::malloc(bytes));
  if (!memory) return;
  for (std::size_t i = 0; i < bytes; i += page) memory[i] = 1;
  std::free(const_cast<char*>(memory));
}

__attribute__((noinline)) void touch_stack() noexcept {
  volatile char stack[128 * 1024];
  for (std::size_t i = 0; i < sizeof stack; i += 1024) stack[i] = 0;
}

}  // namespace

SetupStep lock_memory(std::size_t heap_bytes) {
  SetupStep step{"memory locked", mlockall(MCL_CURRENT | MCL_FUTURE) == 0, ""};
  const int error = errno;
  touch_heap(heap_bytes);
  step.detail = step.granted ? fmt::format("mlockall; {} MB of heap touched", heap_bytes >> 20)
                             : fmt::format("{}: '@realtime - memlock unlimited' in /etc/security/limits.d permits it",
                                           std::strerror(error));
  return step;
}

SetupStep set_fifo_priority(const char* who, int priority) {
  sched_param wanted{};
  wanted.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted);
  return {fmt::format("{}: SCHED_FIFO", who), error == 0,
          error == 0 ? fmt::format("priority {}", priority)
                     : fmt::format("{}: '@realtime - rtprio 95' in /etc/security/limits.d permits it; the thread runs "
                                   "beside all others",
                                   std::strerror(error))};
}

SetupStep pin_to_core(const char* who, int core) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(static_cast<std::size_t>(core), &set);
  const int error = pthread_setaffinity_np(pthread_self(), sizeof set, &set);
  return {fmt::format("{}: core", who), error == 0,
          error == 0 ? fmt::format("core {}", core) : fmt::format("core {}: {}", core, std::strerror(error))};
}

void prepare_thread(const char* name) noexcept {
  pthread_setname_np(pthread_self(), name);
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  sigset_t others;  // what people and timers send; a crash still finds its handler in the thread that crashed
  sigfillset(&others);
  for (const int crash : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP}) sigdelset(&others, crash);
  pthread_sigmask(SIG_BLOCK, &others, nullptr);
  touch_stack();
}

std::vector<int> usable_cores() {
  cpu_set_t set;
  CPU_ZERO(&set);
  std::vector<int> cores;
  if (sched_getaffinity(0, sizeof set, &set) != 0) return cores;
  for (int core = 0; core < CPU_SETSIZE; ++core)
    if (CPU_ISSET(static_cast<std::size_t>(core), &set)) cores.push_back(core);
  return cores;
}

}  // namespace solenoid
