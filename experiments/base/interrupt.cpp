#include "experiments/base/interrupt.hpp"

#include <pthread.h>

namespace solenoid {
namespace {

volatile std::sig_atomic_t interrupt_flag = 0;

void raise_flag(int) { interrupt_flag = 1; }

constexpr int ignored[] = {SIGXFSZ, SIGPIPE};

/// What ends a process by default and is neither a crash nor a limit.
std::vector<int> ending_signals() {
  std::vector<int> signals = {SIGINT,  SIGTERM,   SIGHUP,  SIGQUIT, SIGUSR1, SIGUSR2,
                              SIGALRM, SIGVTALRM, SIGPROF, SIGPOLL, SIGPWR,  SIGSTKFLT};
  for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) signals.push_back(signal);
  return signals;
}

}  // namespace

InterruptGuard::InterruptGuard() {
  interrupt_flag = 0;
  struct sigaction action {};
  sigemptyset(&action.sa_mask);
  const auto set = [&](int signal, void (*handler)(int)) {
    action.sa_handler = handler;
    before_.emplace_back();
    before_.back().first = signal;
    sigaction(signal, &action, &before_.back().second);
  };
  for (const int signal : ending_signals()) set(signal, raise_flag);
  for (const int signal : ignored) set(signal, SIG_IGN);
}

InterruptGuard::~InterruptGuard() {
  for (const auto& [signal, action] : before_) sigaction(signal, &action, nullptr);
}

bool InterruptGuard::raised() { return interrupt_flag != 0; }

void InterruptGuard::leave_in_child() {
  for (const int signal : ending_signals()) std::signal(signal, SIG_DFL);
  for (const int signal : ignored) std::signal(signal, SIG_DFL);
  for (const int signal : {SIGINT, SIGQUIT}) std::signal(signal, SIG_IGN);
}

void InterruptGuard::hear() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : ending_signals()) sigaddset(&set, signal);
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

}  // namespace solenoid
