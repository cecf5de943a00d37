#include "experiments/base/interrupt.hpp"

#include <initializer_list>

namespace solenoid {
namespace {

volatile std::sig_atomic_t interrupt_flag = 0;

void raise_flag(int) { interrupt_flag = 1; }

}  // namespace

InterruptGuard::InterruptGuard() {
  interrupt_flag = 0;
  struct sigaction action {};
  sigemptyset(&action.sa_mask);
  std::size_t i = 0;
  action.sa_handler = raise_flag;
  for (const int signal : caught) sigaction(signal, &action, &before_[i++]);
  action.sa_handler = SIG_IGN;
  for (const int signal : ignored) sigaction(signal, &action, &before_[i++]);
}

InterruptGuard::~InterruptGuard() {
  std::size_t i = 0;
  for (const int signal : caught) sigaction(signal, &before_[i++], nullptr);
  for (const int signal : ignored) sigaction(signal, &before_[i++], nullptr);
}

bool InterruptGuard::raised() { return interrupt_flag != 0; }

void InterruptGuard::leave_in_child() {
  for (const int signal : {SIGTERM, SIGHUP, SIGXFSZ, SIGPIPE}) std::signal(signal, SIG_DFL);
  std::signal(SIGINT, SIG_IGN);
}

}  // namespace solenoid
