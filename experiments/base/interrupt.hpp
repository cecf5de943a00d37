#pragma once

#include <csignal>
#include <utility>
#include <vector>

namespace solenoid {

/// Gives signals other actions, and their own again at its end.
class SignalActions {
 public:
  SignalActions() = default;
  ~SignalActions();
  SignalActions(const SignalActions&) = delete;
  SignalActions& operator=(const SignalActions&) = delete;

  enum class Meanwhile { others_too, alone };
  /// `flags` as of sigaction; `alone`: the thread that handles it takes no other signal meanwhile.
  void set(int signal, void (*handler)(int), int flags = 0, Meanwhile meanwhile = Meanwhile::others_too);

 private:
  std::vector<std::pair<int, struct sigaction>> before_;
};

/// While it lives, every signal that would end the process and is no crash (Ctrl-C, Ctrl-\, SIGTERM, SIGHUP, SIGALRM,
/// SIGUSR2, real-time signals ...) only raises a flag, and a write beyond a file-size limit or to a closed pipe is an
/// error to report, not the process's end.
class InterruptGuard {
 public:
  InterruptGuard();

  static bool raised();
  /// For a process forked below the guard: default actions again, but Ctrl-C and Ctrl-\ are its parent's business.
  static void leave_in_child();
  /// Has the calling thread hear what the guard catches, where real-time threads leave signals to others.
  static void hear();

 private:
  SignalActions actions_;
};

}  // namespace solenoid
