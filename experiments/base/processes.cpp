#include "experiments/base/processes.hpp"

#include "experiments/base/interrupt.hpp"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr int wait_ms = 200;
constexpr char result_mark = '+', error_mark = '-';

using Clock = std::chrono::steady_clock;

double most_silence_s = 0.0;     // of this process, if it is a worker
Clock::time_point next_alarm{};  // until then the one that is set will do

ForkHooks& fork_hooks() {
  static ForkHooks hooks;
  return hooks;
}

void call(const std::function<void()>& hook) {
  if (hook) hook();
}

struct Worker {
  std::size_t item;
  pid_t process;
  int pipe;
  std::string received;
};

/// SIGALRM after so long; 0: none.
void set_alarm(double seconds) noexcept {
  itimerval alarm{};
  alarm.it_value.tv_sec = static_cast<time_t>(seconds);
  alarm.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (seconds - static_cast<double>(alarm.it_value.tv_sec)));
  ::setitimer(ITIMER_REAL, &alarm, nullptr);
}

void send(int pipe, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(pipe, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(n));
  }
}

/// The worker's life: one item, its result or error into the pipe.
[[noreturn]] void serve(std::size_t item, int pipe, pid_t parent, const std::function<std::string(std::size_t)>& work) {
  InterruptGuard::leave_in_child();
  next_alarm = {};
  work_goes_on();
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(1);
  std::string answer;
  try {
    answer = result_mark + work(item);
  } catch (const std::exception& error) {
    answer = error_mark + std::string(error.what());
  } catch (...) {
    answer = error_mark + std::string("unknown exception");
  }
  call(fork_hooks().child_ends);
  set_alarm(0.0);  // from here on it waits for whoever reads
  send(pipe, answer);
  ::_exit(0);
}

Outcome outcome_of(const std::string& received, int status) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) return {false, "stuck: did nothing for longer than it may"};
  if (WIFSIGNALED(status))
    return {false, fmt::format("worker ended by signal {} ({})", WTERMSIG(status), ::strsignal(WTERMSIG(status)))};
  if (WEXITSTATUS(status) != 0) return {false, fmt::format("worker ended with exit code {}", WEXITSTATUS(status))};
  if (received.empty()) return {false, "worker ended without a result"};
  return {received.front() == result_mark, received.substr(1)};
}

class Pool {
 public:
  ~Pool() {
    for (const Worker& worker : workers_) {
      ::kill(worker.process, SIGKILL);
      ::waitpid(worker.process, nullptr, 0);
      ::close(worker.pipe);
    }
  }

  std::size_t size() const { return workers_.size(); }

  /// False if the system has no process or pipe left.
  bool start(std::size_t item, double silence_s, const std::function<std::string(std::size_t)>& work) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return false;
    std::fflush(nullptr);
    call(fork_hooks().before);
    const pid_t self = ::getpid(), process = ::fork();
    if (process == 0) {
      call(fork_hooks().in_child);
      most_silence_s = silence_s;
      serve(item, ends[1], self, work);
    }
    const int error = errno;
    call(fork_hooks().in_parent);
    ::close(ends[1]);
    if (process < 0) ::close(ends[0]);
    errno = error;
    if (process > 0) workers_.push_back({item, process, ends[0], {}});
    return process > 0;
  }

  /// Waits a moment for workers; hands on those that ended.
  void collect(const PoolEvents& events) {
    std::vector<pollfd> pipes;
    for (const Worker& worker : workers_) pipes.push_back({worker.pipe, POLLIN, 0});
    if (::poll(pipes.data(), pipes.size(), wait_ms) <= 0) return;
    for (std::size_t i = pipes.size(); i-- > 0;)
      if (pipes[i].revents != 0 && read_ended(workers_[i])) hand_on(i, events);
  }

 private:
  static bool read_ended(Worker& worker) {
    char buffer[65536];
    const ssize_t n = ::read(worker.pipe, buffer, sizeof buffer);
    if (n > 0) worker.received.append(buffer, static_cast<std::size_t>(n));
    return n == 0 || (n < 0 && errno != EINTR);
  }

  void hand_on(std::size_t index, const PoolEvents& events) {
    const Worker worker = std::move(workers_[index]);
    workers_.erase(workers_.begin() + static_cast<std::ptrdiff_t>(index));
    ::close(worker.pipe);
    int status = 0;
    while (::waitpid(worker.process, &status, 0) < 0 && errno == EINTR) {
    }
    events.ended(worker.item, outcome_of(worker.received, status));
  }

  std::vector<Worker> workers_;
};

}  // namespace

void around_forks(ForkHooks hooks) { fork_hooks() = std::move(hooks); }

void work_goes_on() noexcept {
  if (most_silence_s <= 0) return;
  // A call of the system at each of thousands of ticks would cost a run a twentieth of its time.
  const Clock::time_point now = Clock::now();
  if (now < next_alarm) return;
  const double grace_s = most_silence_s / 64;
  next_alarm = now + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(grace_s));
  set_alarm(most_silence_s + grace_s);
}

bool work_in_processes(std::span<const std::size_t> items, int jobs,
                       const std::function<std::string(std::size_t item)>& work, const PoolEvents& events) {
  Pool pool;
  auto next = items.begin();
  while (next != items.end() || pool.size() > 0) {
    if (events.interrupted()) return false;
    while (next != items.end() && pool.size() < static_cast<std::size_t>(jobs)) {
      if (!pool.start(*next, events.most_silence_s, work)) {
        if (pool.size() == 0) throw std::runtime_error(fmt::format("no worker process: {}", std::strerror(errno)));
        break;
      }
      events.started(*next++);
    }
    pool.collect(events);
    events.waiting();
  }
  return true;
}

}  // namespace solenoid
