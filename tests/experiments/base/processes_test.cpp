#include "experiments/base/processes.hpp"

#include <csignal>
#include <cstdlib>
#include <ctime>
#include <map>
#include <numeric>
#include <stdexcept>

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

namespace solenoid {
namespace {

using testing::HasSubstr;

struct Recorded {
  std::map<std::size_t, Outcome> outcomes;
  std::size_t running = 0, most_running = 0;

  PoolEvents events() {
    PoolEvents e;
    e.started = [this](std::size_t) { most_running = std::max(most_running, ++running); };
    e.ended = [this](std::size_t item, const Outcome& outcome) {
      --running;
      outcomes[item] = outcome;
    };
    e.waiting = [] {};
    e.interrupted = [] { return false; };
    return e;
  }
};

std::vector<std::size_t> items(std::size_t n) {
  std::vector<std::size_t> all(n);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

TEST(Processes, EveryItemIsDoneOnceAndJobsAreTheMost) {
  for (const int jobs : {1, 3, 50}) {
    Recorded recorded;
    EXPECT_TRUE(work_in_processes(
        items(20), jobs, [](std::size_t i) { return std::to_string(i * i); }, recorded.events()));
    ASSERT_EQ(recorded.outcomes.size(), 20u);
    for (const auto& [item, outcome] : recorded.outcomes) {
      EXPECT_TRUE(outcome.done);
      EXPECT_EQ(outcome.text, std::to_string(item * item));
    }
    EXPECT_LE(recorded.most_running, static_cast<std::size_t>(jobs));
  }
}

TEST(Processes, ACrashOrExceptionIsThatItemsAlone) {
  Recorded recorded;
  const auto work = [](std::size_t i) -> std::string {
    if (i == 0) std::abort();
    if (i == 1) throw std::runtime_error("no such plant");
    if (i == 2) ::raise(SIGKILL);
    if (i == 3) ::_exit(7);
    if (i == 4) ::_exit(0);
    return "fine";
  };
  EXPECT_TRUE(work_in_processes(items(7), 3, work, recorded.events()));
  ASSERT_EQ(recorded.outcomes.size(), 7u);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_FALSE(recorded.outcomes[i].done) << i;
  EXPECT_THAT(recorded.outcomes[0].text, HasSubstr("signal 6"));
  EXPECT_EQ(recorded.outcomes[1].text, "no such plant");
  EXPECT_THAT(recorded.outcomes[2].text, HasSubstr("signal 9"));
  EXPECT_THAT(recorded.outcomes[3].text, HasSubstr("exit code 7"));
  EXPECT_THAT(recorded.outcomes[4].text, HasSubstr("without a result"));
  EXPECT_EQ(recorded.outcomes[5].text, "fine");
  EXPECT_EQ(recorded.outcomes[6].text, "fine");
}

TEST(Processes, SilenceForTooLongIsAnEndToo) {
  Recorded recorded;
  PoolEvents events = recorded.events();
  events.most_silence_s = 0.4;
  const auto work = [](std::size_t i) -> std::string {
    if (i == 0) ::pause();
    for (int step = 0; step < 8; ++step) {  // longer than that, but not in silence
      timespec rest = {0, 100'000'000};
      ::nanosleep(&rest, nullptr);
      work_goes_on();
    }
    return "fine";
  };
  EXPECT_TRUE(work_in_processes(items(2), 2, work, events));
  EXPECT_FALSE(recorded.outcomes[0].done);
  EXPECT_THAT(recorded.outcomes[0].text, HasSubstr("stuck"));
  EXPECT_EQ(recorded.outcomes[1].text, "fine");
}

TEST(Processes, HooksAreCalledAroundEachFork) {
  int before = 0, after = 0, in_child = 0;
  around_forks({.before = [&] { ++before; },
                .in_parent = [&] { ++after; },
                .in_child = [&] { ++in_child; },
                .child_ends = [&] { in_child += 10; }});
  Recorded recorded;
  EXPECT_TRUE(work_in_processes(
      items(3), 2, [&](std::size_t) { return std::to_string(100 * before + 10 * after + in_child); },
      recorded.events()));
  around_forks({});
  EXPECT_EQ(before, 3);
  EXPECT_EQ(after, 3);
  EXPECT_EQ(in_child, 0);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(recorded.outcomes[i].text, std::to_string(100 * (i + 1) + 10 * i + 1)) << i;
}

TEST(Processes, ResultsLargerThanAPipeArriveWhole) {
  Recorded recorded;
  work_in_processes(
      items(3), 2, [](std::size_t i) { return std::string(300000, static_cast<char>('a' + i)); }, recorded.events());
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(recorded.outcomes[i].text, std::string(300000, static_cast<char>('a' + i)));
}

TEST(Processes, AnInterruptEndsTheWorkers) {
  Recorded recorded;
  PoolEvents events = recorded.events();
  events.interrupted = [&] { return !recorded.outcomes.empty(); };
  const auto work = [](std::size_t i) -> std::string {
    if (i > 0) ::pause();  // for ever, but for the pool's end
    return "first";
  };
  EXPECT_FALSE(work_in_processes(items(4), 2, work, events));
  EXPECT_EQ(recorded.outcomes.size(), 1u);
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a worker is left";
}

TEST(Processes, AThrowingListenerEndsTheWorkers) {
  Recorded recorded;
  PoolEvents events = recorded.events();
  events.ended = [](std::size_t, const Outcome&) { throw std::runtime_error("disk full"); };
  const auto work = [](std::size_t i) -> std::string {
    if (i > 0) ::pause();
    return "first";
  };
  EXPECT_THROW(work_in_processes(items(4), 2, work, events), std::runtime_error);
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
}

}  // namespace
}  // namespace solenoid
