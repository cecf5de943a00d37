#include "core/rt/background_solver.hpp"

#include "tests/support/double_integrator.hpp"

#include <atomic>
#include <stdexcept>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using Asked = Problem<DoubleIntegrator>;

constexpr double look_s = 100e-6;

/// What a test tells the solver in the other thread, and hears of it. It outlives both.
struct Shared {
  std::atomic<bool> held = false;
  std::atomic<int> begun = 0, solved = 0, anticipated = 0, destroyed = 0;
};

void wait_until(const auto& condition) {
  MonotonicClock clock;
  while (!condition()) clock.sleep_until(clock.now_s() + look_s);
}

/// Its plan begins with the mode against the position, its cost is the position.
struct Scripted final : Solver<DoubleIntegrator> {
  Scripted(std::shared_ptr<Shared> with, bool refuse = false) : shared(std::move(with)), refuses(refuse) {}
  ~Scripted() override { ++shared->destroyed; }
  void prepare(const Asked&) override {
    if (refuses) throw std::invalid_argument("no such horizon");
  }
  SolveReport solve(const Asked& problem, Plan<DoubleIntegrator>& plan, Deadline deadline) noexcept override {
    ++shared->begun;
    wait_until([&] { return !shared->held; });
    plan.modes.front() = problem.initial[0] > 0 ? 0 : 1;
    SolveReport report{deadline.passed() ? Status::deadline_reached : Status::optimal, problem.initial[0]};
    report.anticipated = expected == problem.reference.front()[0];
    ++shared->solved;
    return report;
  }
  bool anticipates() const override { return true; }
  void anticipate(const Asked& problem, const Plan<DoubleIntegrator>&) noexcept override {
    expected = problem.reference.front()[0];
    ++shared->anticipated;
  }

  std::shared_ptr<Shared> shared;
  bool refuses;
  double expected = -1.0;
};

struct BackgroundSolverTest : testing::Test {
  Asked at(double position, double reference = 0.0) const {
    Asked problem(DoubleIntegrator(), bang_bang(), {0.1, {1, 2}}, {});
    problem.initial = {position, 0.0};
    problem.reference.front()[0] = reference;
    return problem;
  }
  std::unique_ptr<BackgroundSolver> started(SolverThreadSettings settings = {}) {
    settings.look_s = look_s;
    auto solver = std::make_unique<BackgroundSolver>(std::make_unique<Scripted>(shared), settings);
    solver->prepare(at(0.0));
    return solver;
  }
  /// The plan under this ticket; `seen` gets all that were collected until then.
  static SolveReport collect(BackgroundSolver& solver, std::int64_t ticket, std::vector<std::int64_t>& seen) {
    SolveReport report;
    wait_until([&] {
      const auto* done = solver.collect();
      if (done) seen.push_back(done->ticket), report = done->report;
      return done && done->ticket == ticket;
    });
    return report;
  }
  std::shared_ptr<Shared> shared = std::make_shared<Shared>();
};

// A problem out of turn, because a switch failed in the middle of a period, does not wait for the next period: it would wait an hour.
TEST_F(BackgroundSolverTest, TakesUpWhatIsPostedOutOfTurn) {
  SolverThreadSettings hourly;
  hourly.period_s = 3600.0;
  const auto solver = started(hourly);
  std::vector<std::int64_t> seen;
  for (const std::int64_t ticket : {0, 3, 5}) {
    const Asked problem = at(1.0 + static_cast<double>(ticket));
    solver->post(ticket, problem, Plan<DoubleIntegrator>(problem), 0.0);
    EXPECT_EQ(collect(*solver, ticket, seen).cost, 1.0 + static_cast<double>(ticket));
  }
  EXPECT_EQ(seen, (std::vector<std::int64_t>{0, 3, 5}));
}

TEST_F(BackgroundSolverTest, SolvesAsTheSolverInsideDoes) {
  SolverThreadSettings on_a_core;
  on_a_core.core = 0;
  const auto solver = started(on_a_core);
  for (const double position : {0.5, -0.25, 2.0}) {
    Plan<DoubleIntegrator> plan(at(position));
    EXPECT_EQ(solver->solve(at(position), plan, Deadline::never()).cost, position);
    EXPECT_EQ(plan.modes.front(), position > 0 ? 0 : 1);
  }
}

TEST_F(BackgroundSolverTest, APostReplacesOneThatIsNotYetBegun) {
  const auto solver = started();
  const Plan<DoubleIntegrator> warm(at(0.0));
  shared->held = true;
  solver->post(1, at(1.0), warm, 0.0);
  wait_until([&] { return shared->begun == 1; });
  EXPECT_EQ(solver->collect(), nullptr);
  solver->post(2, at(2.0), warm, 0.0);
  solver->post(3, at(3.0), warm, 0.0);
  shared->held = false;
  std::vector<std::int64_t> seen;
  EXPECT_EQ(collect(*solver, 3, seen).cost, 3.0);
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 2), 0);
  EXPECT_EQ(shared->solved, 2);
  EXPECT_EQ(solver->collect(), nullptr);  // every plan is handed out once
}

TEST_F(BackgroundSolverTest, ABudgetIsADeadlineAndNoneIsNone) {
  const auto solver = started();
  const Plan<DoubleIntegrator> warm(at(0.0));
  std::vector<std::int64_t> seen;
  solver->post(1, at(1.0), warm, 1e-9);
  EXPECT_EQ(collect(*solver, 1, seen).status, Status::deadline_reached);
  solver->post(2, at(1.0), warm, 0.0);
  EXPECT_EQ(collect(*solver, 2, seen).status, Status::optimal);
}

TEST_F(BackgroundSolverTest, AnticipatesWhatIsExpectedBeforeItSolves) {
  const auto solver = started();
  EXPECT_TRUE(solver->anticipates());
  const Plan<DoubleIntegrator> warm(at(0.0));
  std::vector<std::int64_t> seen;
  solver->anticipate(at(0.0, 7.0), warm);
  wait_until([&] { return shared->anticipated == 1; });
  EXPECT_EQ(shared->begun, 0);
  solver->post(1, at(1.0, 7.0), warm, 0.0);
  EXPECT_TRUE(collect(*solver, 1, seen).anticipated);
  solver->post(2, at(1.0, 8.0), warm, 0.0);
  EXPECT_FALSE(collect(*solver, 2, seen).anticipated);
}

TEST_F(BackgroundSolverTest, PassesOnThatASolverRefusesAProblem) {
  BackgroundSolver solver(std::make_unique<Scripted>(shared, true), {});
  EXPECT_THROW(solver.prepare(at(0.0)), std::invalid_argument);
}

TEST_F(BackgroundSolverTest, LeavesASolveThatHangsBehindWithAllItUses) {
  SolverThreadSettings impatient;
  impatient.patience_s = 0.01;
  auto solver = started(impatient);
  shared->held = true;
  solver->post(1, at(1.0), Plan<DoubleIntegrator>(at(0.0)), 0.0);
  wait_until([&] { return shared->begun == 1; });
  solver.reset();
  EXPECT_EQ(shared->solved, 0);  // it did not wait for that
  EXPECT_EQ(shared->destroyed, 0);
  shared->held = false;
  wait_until([&] { return shared->destroyed == 1; });  // the thread ends, and takes with it what it used
  EXPECT_EQ(shared->solved, 1);
}

}  // namespace
}  // namespace solenoid
