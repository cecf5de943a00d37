#include "experiments/campaign/run_in_progress.hpp"

#include "controllers/any_solver.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulate.hpp"

#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// A solver that gives up in its n-th solve, and says so in every later one.
class GivesUp final : public SolverAround {
 public:
  GivesUp(AnySolverPtr inner, int at, int& solves) : SolverAround(std::move(inner)), at_(at), solves_(solves) {}

 private:
  SolveReport do_solve(const AnyProblem& problem, AnyPlan& plan, Deadline deadline) noexcept override {
    if (++solves_ < at_) return SolverAround::do_solve(problem, plan, deadline);
    fail_run(std::make_exception_ptr(std::runtime_error("gave up in solve " + std::to_string(solves_))));
    return {};
  }

  int at_;
  int& solves_;
};

ScenarioConfig half_a_second() {
  ScenarioConfig scenario;
  scenario.name = "short";
  scenario.trajectory = Trajectory(0.0197).cycloid_to(0.05, 1.0);
  scenario.duration_s = 0.5;
  return scenario;
}

TEST(RunInProgress, ARunThatFailsEndsWithTheTickAndThrowsWhatItWasTold) {
  int solves = 0;
  const auto run = [&](int at) {
    solves = 0;
    simulate(shipped_variant("thesis_pd"), half_a_second(), 1,
             [&](AnySolverPtr inner) { return std::make_unique<GivesUp>(std::move(inner), at, solves); });
  };
  try {
    run(3);
    ADD_FAILURE() << "it ended well";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "gave up in solve 3");
  }
  EXPECT_EQ(solves, 3);
  EXPECT_NO_THROW(run(1000));
  EXPECT_GT(solves, 50);
  EXPECT_EQ(RunInProgress::here(), nullptr);
}

TEST(RunInProgress, TheInnermostOfItsThreadHearsIt) {
  const ScenarioConfig outer_scenario = half_a_second(), inner_scenario = half_a_second();
  const auto fail = [](const char* why) { fail_run(std::make_exception_ptr(std::runtime_error(why))); };
  fail("nobody hears it");
  const RunInProgress outer(outer_scenario);
  {
    const RunInProgress inner(inner_scenario);
    EXPECT_EQ(&RunInProgress::here()->scenario(), &inner_scenario);
    fail("the first counts");
    fail("no other");
    EXPECT_TRUE(inner.failed());
    EXPECT_THROW(
        {
          try {
            inner.require_sound();
          } catch (const std::runtime_error& error) {
            EXPECT_STREQ(error.what(), "the first counts");
            throw;
          }
        },
        std::runtime_error);
  }
  EXPECT_EQ(&RunInProgress::here()->scenario(), &outer_scenario);
  std::thread([&] {
    EXPECT_EQ(RunInProgress::here(), nullptr);
    fail("in another thread");
  }).join();
  EXPECT_FALSE(outer.failed());
  EXPECT_NO_THROW(outer.require_sound());
}

}  // namespace
}  // namespace solenoid
