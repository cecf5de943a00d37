// Every signal there is, to a process that guards a rig: it goes on, or its outputs are safe first.
#include "experiments/base/interrupt.hpp"
#include "experiments/rig/rig_guard.hpp"
#include "experiments/rig/rig_io.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <ctime>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <pthread.h>
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

/// A card that takes its time.
struct SlowIo final : RigIo {
  explicit SlowIo(int file) : to(file) {}
  void open() override {}
  RigInputs read() noexcept override { return {}; }
  void write(const RigOutputs&) noexcept override {}
  void safe() noexcept override {
    const timespec rest{0, 5'000'000};
    ::nanosleep(&rest, nullptr);
    [[maybe_unused]] const ssize_t written = ::write(to, "s", 1);
  }
  IoHealth health() const noexcept override { return {}; }
  int to;
};

struct End {
  int status = 0;
  std::string told;
};

/// What becomes of a process that gets the signal while it guards a rig.
End end_by(int signal) {
  std::array<int, 2> ends{};
  EXPECT_EQ(::pipe(ends.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    ToldIo io(ends[1]);
    const InterruptGuard interrupt;
    const RigGuard guard(io);
    ::kill(::getpid(), signal);
    ::_exit(InterruptGuard::raised() ? was_asked_to_end : went_on);
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
  for (const int second : {SIGSEGV, SIGABRT, SIGBUS}) {
    std::array<int, 2> ends{};
    ASSERT_EQ(::pipe(ends.data()), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      const rlimit no_core{0, 0};
      ::setrlimit(RLIMIT_CORE, &no_core);
      SlowIo io(ends[1]);
      const RigGuard guard(io);
      std::thread other([&] { ::pthread_kill(::pthread_self(), SIGSEGV); });
      const timespec until_the_first_is_at_it{0, 2'000'000};
      ::nanosleep(&until_the_first_is_at_it, nullptr);
      std::raise(second);
      ::_exit(went_on);
    }
    ::close(ends[1]);
    std::string told;
    std::array<char, 16> bytes;
    for (ssize_t size; (size = ::read(ends[0], bytes.data(), bytes.size())) > 0;)
      told.append(bytes.data(), static_cast<std::size_t>(size));
    ::close(ends[0]);
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(told, "ss");
    EXPECT_TRUE(WIFSIGNALED(status));
  }
}

}  // namespace
}  // namespace solenoid
