#pragma once

#include <csignal>

namespace solenoid {

/// While it lives, Ctrl-C, SIGTERM and SIGHUP only raise a flag, and a write beyond a file-size limit or to a closed
/// pipe is an error to report, not the process's end.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  static bool raised();
  /// For a process forked below the guard: default actions again, but Ctrl-C is its parent's business.
  static void leave_in_child();

 private:
  static constexpr int caught[] = {SIGINT, SIGTERM, SIGHUP};
  static constexpr int ignored[] = {SIGXFSZ, SIGPIPE};
  struct sigaction before_[5];
};

}  // namespace solenoid
