#include "experiments/rig/rig_guard.hpp"

#include "experiments/rig/rig_io.hpp"

#include <atomic>
#include <cerrno>
#include <ctime>
#include <string_view>

#include <unistd.h>

namespace solenoid {
namespace {

std::atomic<RigIo*> guarded_io{nullptr};
std::atomic<bool> crash_flag{false}, made_safe{false};

void wait_a_millisecond() {
  const timespec millisecond{0, 1'000'000};
  ::nanosleep(&millisecond, nullptr);
}

extern "C" void make_safe_and_crash(int signal) {
  constexpr int longest_ms = 100;
  crash_flag.store(true);
  if (RigIo* const io = guarded_io.exchange(nullptr)) {
    io->safe();
    wait_a_millisecond();  // until a write under way is done
    io->safe();
    made_safe.store(true);
  } else {
    for (int k = 0; k < longest_ms && !made_safe.load(); ++k) wait_a_millisecond();  // another thread is at it
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

extern "C" void refuse_to_stop(int) {
  const int before = errno;
  constexpr std::string_view told = "\nsolenoid: a run is not stopped (Ctrl-Z): Ctrl-C ends it, outputs safe\n";
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, told.data(), told.size());
  errno = before;
}

}  // namespace

RigGuard::RigGuard(RigIo& io) {
  made_safe.store(false);
  guarded_io.store(&io);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP, SIGXCPU})
    actions_.set(signal, make_safe_and_crash, 0, SignalActions::Meanwhile::alone);
  actions_.set(SIGTSTP, refuse_to_stop, SA_RESTART);
  for (const int signal : {SIGTTIN, SIGTTOU}) actions_.set(signal, SIG_IGN, SA_RESTART);
}

bool RigGuard::crashing() noexcept { return crash_flag.load(std::memory_order_relaxed); }

RigGuard::~RigGuard() { guarded_io.store(nullptr); }

}  // namespace solenoid
