#pragma once

#include "experiments/base/interrupt.hpp"

namespace solenoid {

class RigIo;

/// While it lives, nothing ends or stops the process before this io is safe, but for SIGKILL and SIGSTOP, which no
/// process can catch. A crash (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP) and the time limit of a
/// real-time thread (SIGXCPU) make it safe in the handler, and then take their course. A stop from the terminal
/// (SIGTSTP, SIGTTIN, SIGTTOU) is refused. What asks the process to end raises InterruptGuard's flag. One at a time.
class RigGuard {
 public:
  explicit RigGuard(RigIo& io);
  ~RigGuard();
  RigGuard(const RigGuard&) = delete;
  RigGuard& operator=(const RigGuard&) = delete;

  /// Whether a crash has begun: no thread may command anything any more.
  static bool crashing() noexcept;

 private:
  SignalActions actions_;
};

}  // namespace solenoid
