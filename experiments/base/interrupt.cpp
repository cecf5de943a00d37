#include "experiments/base/interrupt.hpp"

#include <pthread.h>

namespace solenoid {
namespace {

volatile std::sig_atomic_t interrupt_flag = 0;

void raise_flag(int) { interrupt_flag = 1; }

/// What ends a process by default and is neither a crash nor a limit.
std::vector<int> ending_signals() {
  std::vector<int> signals = {SIGINT,  SIGTERM,   SIGHUP,  SIGQUIT, SIGUSR1, SIGUSR2,
                              SIGALRM, SIGVTALRM, SIGPROF, SIGPOLL, SIGPWR,  SIGSTKFLT};
  for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) signals.push_back(signal);
  return signals;
}

}  // namespace

void SignalActions::set(int signal, void (*handler)(int), int flags, Meanwhile meanwhile) {
  struct sigaction action {};
  if (meanwhile == Meanwhile::alone)
    sigfillset(&action.sa_mask);
  else
    sigemptyset(&action.sa_mask);
  action.sa_handler = handler;
  action.sa_flags = flags;
  before_.emplace_back();
  before_.back().first = signal;
  sigaction(signal, &action, &before_.back().second);
}

SignalActions::~SignalActions() {
  for (const auto& [signal, action] : before_) sigaction(signal, &action, nullptr);
}

InterruptGuard::InterruptGuard() {
  interrupt_flag = 0;
  for (const int signal : ending_signals()) actions_.set(signal, raise_flag);
  for (const int signal : {SIGXFSZ, SIGPIPE}) actions_.set(signal, SIG_IGN);
}

bool InterruptGuard::raised() { return interrupt_flag != 0; }

void InterruptGuard::leave_in_child() {
  for (const int signal : ending_signals()) std::signal(signal, SIG_DFL);
  std::signal(SIGPIPE, SIG_DFL);
  for (const int signal : {SIGINT, SIGQUIT}) std::signal(signal, SIG_IGN);
}

void InterruptGuard::hear() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : ending_signals()) sigaddset(&set, signal);
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

}  // namespace solenoid
