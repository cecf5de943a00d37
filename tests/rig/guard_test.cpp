// Every signal there is, to a process that guards a rig: it goes on, or its outputs are safe first.
#include "experiments/base/interrupt.hpp"
#include "experiments/rig/rig_guard.hpp"
#include "experiments/rig/rig_io.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <ctime>
#include <functional>
#include <string>
#include <thread>
#include <utility>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace solenoid {
namespace {

/// Tells a pipe that it was made safe.
struct ToldIo final : RigIo {
  explicit ToldIo(int file) : to(file) {}
  void open() override {}
  RigInputs read() noexcept override { return {}; }
  void write(const RigOutputs&) noexcept override {}
  void safe() noexcept override { [[maybe_unused]] const ssize_t written = ::write(to, "s", 1); }
  IoHealth health() const noexcept override { return {}; }
  int to;
};

constexpr int was_asked_to_end = 7, went_on = 8;

/// A card that takes its time, in which more may happen.
struct SlowIo final : RigIo {
  SlowIo(int file, std::function<void()> happens) : to(file), meanwhile(std::move(happens)) {}
  void open() override {}
  RigInputs read() noexcept override { return {}; }
  void write(const RigOutputs&) noexcept override {}
  void safe() noexcept override {
    if (!std::exchange(begun, true)) meanwhile();
    const timespec rest{0, 5'000'000};
    ::nanosleep(&rest, nullptr);
    [[maybe_unused]] const ssize_t written = ::write(to, "s", 1);
  }
  IoHealth health() const noexcept override { return {}; }
  int to;
  std::function<void()> meanwhile;
  bool begun = false;
};

struct End {
  int status = 0;
  std::string told;
};

/// What becomes of a process that does this, told where to write.
End end_of(const std::function<void(int)>& process) {
  std::array<int, 2> ends{};
  EXPECT_EQ(::pipe(ends.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    process(ends[1]);
    ::_exit(went_on);
  }
  ::close(ends[1]);
  End end;
  ::waitpid(child, &end.status, WUNTRACED);
  if (WIFSTOPPED(end.status)) {
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
  std::array<char, 16> told;
  for (ssize_t size; (size = ::read(ends[0], told.data(), told.size())) > 0;)
    end.told.append(told.data(), static_cast<std::size_t>(size));
  ::close(ends[0]);
  return end;
}

/// That gets the signal while it guards a rig.
End end_by(int signal) {
  return end_of([signal](int told) {
    ToldIo io(told);
    const InterruptGuard interrupt;
    const RigGuard guard(io);
    ::kill(::getpid(), signal);
    ::_exit(InterruptGuard::raised() ? was_asked_to_end : went_on);
  });
}

/// That crashes, and crashes in the same thread again while its outputs are made safe.
End end_by_both(int first, int second) {
  return end_of([=](int told) {
    SlowIo io(told, [=] { std::raise(second); });
    const RigGuard guard(io);
    std::raise(first);
  });
}

/// The same, in another thread.
End end_by_both_in_threads(int first, int second) {
  return end_of([=](int told) {
    std::atomic<bool> at_it{false};
    SlowIo io(told, [&] { at_it.store(true); });
    const RigGuard guard(io);
    std::thread other([&] {
      while (!at_it.load()) std::this_thread::yield();
      std::raise(second);
    });
    std::raise(first);
    other.join();
  });
}

TEST(RigGuard, NoSignalEndsOrStopsAProcessBeforeItsOutputsAreSafe) {
  constexpr std::array never = {SIGKILL, SIGSTOP};
  constexpr std::array crashes = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP, SIGXCPU};
  constexpr std::array ends_nothing = {SIGCHLD, SIGURG, SIGWINCH, SIGCONT, SIGTSTP, SIGTTIN, SIGTTOU, SIGPIPE, SIGXFSZ};
  const auto among = [](const auto& list, int signal) { return std::ranges::find(list, signal) != list.end(); };
  int seen = 0;
  for (int signal = 1; signal <= SIGRTMAX; ++signal) {
    if (among(never, signal) || (signal > SIGSYS && signal < SIGRTMIN)) continue;  // the C library keeps two
    SCOPED_TRACE(strsignal(signal));
    const End end = end_by(signal);
    ++seen;
    ASSERT_FALSE(WIFSTOPPED(end.status));
    if (among(crashes, signal)) {
      EXPECT_EQ(end.told, "ss");
      EXPECT_TRUE(WIFSIGNALED(end.status));
      EXPECT_EQ(WTERMSIG(end.status), signal);
    } else {
      EXPECT_EQ(end.told, "");  // the loop makes safe, in its time
      ASSERT_TRUE(WIFEXITED(end.status)) << end.status;
      EXPECT_EQ(WEXITSTATUS(end.status), among(ends_nothing, signal) ? went_on : was_asked_to_end);
    }
  }
  EXPECT_GT(seen, 55);
}

TEST(RigGuard, AnotherCrashMeanwhileDoesNotEndTheProcessBeforeItsOutputsAreSafe) {
  constexpr int times = 5;
  for (const auto& end_by_two : {end_by_both, end_by_both_in_threads})
    for (const int second : {SIGSEGV, SIGABRT, SIGBUS, SIGXCPU})
      for (int k = 0; k < times; ++k) {
        SCOPED_TRACE(strsignal(second));
        const End end = end_by_two(SIGSEGV, second);
        EXPECT_EQ(end.told, "ss");
        EXPECT_TRUE(WIFSIGNALED(end.status)) << end.status;
      }
}

}  // namespace
}  // namespace solenoid
