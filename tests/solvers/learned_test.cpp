#include "solvers/learned/judged_policy.hpp"
#include "solvers/learned/network_proposer.hpp"
#include "solvers/learned/tail_search.hpp"
#include "solvers/search/branch_and_bound.hpp"
#include "solvers/search/exhaustive.hpp"
#include "tests/support/double_integrator.hpp"
#include "tests/support/uniform.hpp"

#include <cmath>
#include <utility>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using Integrator = Problem<DoubleIntegrator>;
using IntegratorPlan = Plan<DoubleIntegrator>;

/// Proposes what it is told to.
class Parrot final : public Proposer<DoubleIntegrator> {
 public:
  explicit Parrot(std::vector<ModeSequence>& sequences) : sequences_(sequences) {}
  void prepare(const Integrator&) override {}
  int propose(const Integrator&, std::span<ModeSequence> into) noexcept override {
    const std::size_t count = std::min(into.size(), sequences_.size());
    std::copy_n(sequences_.begin(), count, into.begin());
    return static_cast<int>(count);
  }

 private:
  std::vector<ModeSequence>& sequences_;
};

/// Delays, dwells and bounds at random, commands in flight.
Integrator random_problem(std::mt19937_64& random, int trial, std::size_t blocks) {
  const auto delay = [&] { return 0.1 * std::floor(uniform(random, 0, 5)); };
  const double dwell = trial % 3 == 0 ? delay() : 0.0;
  Horizon horizon{0.1, {}};
  for (std::size_t b = 0; b < blocks; ++b) horizon.blocks.push_back(1 + static_cast<int>(random() % 5));
  Cost<DoubleIntegrator> cost;
  cost.tracking = {uniform(random, 0, 1), trial % 2 ? uniform(random, 0, 1) : 0.0};
  cost.terminal = {uniform(random, 0, 5), uniform(random, 0, 5)};
  cost.switching = trial % 2 ? uniform(random, 0, 0.3) : 0.0;
  Bounds<DoubleIntegrator> bounds;
  if (trial % 4 == 0) bounds.state_upper = {uniform(random, 0.5, 2), uniform(random, 0.2, 1)};
  Integrator problem(DoubleIntegrator{}, bang_coast_bang(delay(), delay(), dwell), horizon, cost, bounds);
  problem.initial = {uniform(random, -1, 1), uniform(random, -1, 1)};
  for (auto& r : problem.reference) r = {uniform(random, -1, 1), uniform(random, -1, 1)};
  const SwitchTiming timing(problem.modes, 0.1);
  for (int i = 0; i < 3; ++i) {
    problem.lines.command(problem.modes.pattern(static_cast<int>(random() % 3)), timing);
    problem.lines.advance(static_cast<int>(random() % 3));
  }
  return problem;
}

ModeSequence random_sequence(std::mt19937_64& random, std::size_t blocks) {
  ModeSequence s{};
  for (std::size_t b = 0; b < blocks; ++b) s[b] = static_cast<std::uint16_t>(random() % 3);
  return s;
}

double cost_of(const Integrator& problem, const std::vector<int>& modes) {
  IntegratorPlan plan(problem);
  plan.modes = modes;
  return evaluate(problem, plan).cost;
}

TEST(JudgedPolicy, IsNeverWorseThanWarmStartHoldingAndProposalsAndTellsItsTrueCost) {
  std::mt19937_64 random(11);
  int usable_plans = 0, refused = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const std::size_t blocks = 1 + random() % 5;
    const Integrator problem = random_problem(random, trial, blocks);
    std::vector<ModeSequence> proposals;
    for (std::size_t i = 0; i < random() % 30; ++i) proposals.push_back(random_sequence(random, blocks));
    JudgedPolicy<DoubleIntegrator> policy(std::make_unique<Parrot>(proposals));
    policy.prepare(problem);
    IntegratorPlan plan(problem);
    for (int& mode : plan.modes) mode = static_cast<int>(random() % 3);
    const double warm = cost_of(problem, plan.modes);
    const int hold = problem.modes.find(problem.lines.commanded());
    const SolveReport report = policy.solve(problem, plan, Deadline::never());
    EXPECT_LE(report.cost, warm);
    EXPECT_LE(report.cost, cost_of(problem, std::vector<int>(blocks, hold)));
    for (std::size_t i = 0; i < std::min<std::size_t>(14, proposals.size()); ++i)
      EXPECT_LE(report.cost, cost_of(problem, {proposals[i].begin(), proposals[i].begin() + std::ssize(plan.modes)}));
    EXPECT_TRUE(report.work().within(policy.most_work(problem)->solve));
    const SolveReport judged = evaluate(problem, plan);
    if (report.status == Status::infeasible) {
      ++refused;
      EXPECT_EQ(plan.modes, std::vector<int>(blocks, hold));
      continue;
    }
    ++usable_plans;
    EXPECT_EQ(report.status, Status::feasible);
    EXPECT_EQ(report.cost, judged.cost);
    EXPECT_EQ(report.switches, judged.switches);
    EXPECT_LE(report.bound, report.cost);
  }
  EXPECT_GT(usable_plans, 200);
  EXPECT_GT(refused, 5);
}

TEST(JudgedPolicy, TakesTheOptimumWhereItIsProposedAndSaysWhenNothingIsANumber) {
  std::mt19937_64 random(12);
  for (int trial = 0; trial < 100; ++trial) {
    Integrator problem = random_problem(random, trial, 4);
    Exhaustive<DoubleIntegrator> search;
    search.prepare(problem);
    IntegratorPlan optimum(problem), plan(problem);
    const SolveReport best = search.solve(problem, optimum, Deadline::never());
    if (best.status != Status::optimal) continue;
    std::vector<ModeSequence> proposals(1);
    std::ranges::copy(optimum.modes, proposals.front().begin());
    JudgedPolicy<DoubleIntegrator> policy(std::make_unique<Parrot>(proposals));
    policy.prepare(problem);
    EXPECT_EQ(policy.solve(problem, plan, Deadline::never()).cost, best.cost);
    EXPECT_EQ(plan.modes, optimum.modes);
    problem.initial[0] = std::nan("");
    EXPECT_EQ(policy.solve(problem, plan, Deadline::never()).status, Status::numerical_failure);
  }
}

TEST(TaughtSearch, FindsTheSamePlansWhateverIsProposed) {
  std::mt19937_64 random(13);
  std::int64_t helped = 0, alone = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Integrator problem = random_problem(random, trial, 4);
    BranchAndBound<DoubleIntegrator> search;
    search.prepare(problem);
    IntegratorPlan plan(problem), other(problem);
    const SolveReport best = search.solve(problem, plan, Deadline::never());
    std::vector<ModeSequence> proposals(1, random_sequence(random, 4));
    if (trial % 2 == 0) std::ranges::copy(plan.modes, proposals.front().begin());
    BranchAndBound<DoubleIntegrator> taught({}, rollout_kernel<DoubleIntegrator>(),
                                            std::make_unique<Parrot>(proposals));
    taught.prepare(problem);
    const SolveReport report = taught.solve(problem, other, Deadline::never());
    EXPECT_EQ(report.cost, best.cost);
    EXPECT_EQ(report.status, best.status);
    EXPECT_EQ(other.modes, plan.modes);
    EXPECT_TRUE(report.work().within(taught.most_work(problem)->solve));
    if (trial % 2 == 0) helped += report.nodes, alone += best.nodes;
  }
  EXPECT_LT(helped, alone + 100 * 4);  // of the proposal itself four nodes each
}

/// A network that always gives the same scores.
std::shared_ptr<const Mlp> constant_scores(const Integrator& problem, const std::vector<float>& scores,
                                           const std::vector<int>& labels) {
  ProblemFeatures<DoubleIntegrator> features;
  features.prepare(problem);
  MlpData d;
  d.kind = policy_kind;
  d.layout = features.layout();
  d.features = static_cast<int>(features.size());
  d.labels = labels;
  d.inputs = {{}};
  d.layers = {{1, static_cast<int>(scores.size()), std::vector<float>(scores.size(), 0.0f), scores}};
  return std::make_shared<const Mlp>(d);
}

TEST(NetworkProposer, ProposesTheModesOfThePatternsThatItKnowsHereToo) {
  const Integrator problem(DoubleIntegrator{}, bang_coast_bang(), {0.1, {1, 2}}, {});
  // Labels: left (pattern 2), both at once (3, no mode here), coasting (0). Modes: coast 0, right 1, left 2.
  const std::vector<int> labels = {2, 3, 0};
  NetworkProposer<DoubleIntegrator> proposer(constant_scores(problem, {1, 9, 0, 2, 9, 5}, labels));
  proposer.prepare(problem);
  std::array<ModeSequence, 6> found{};
  ASSERT_EQ(proposer.propose(problem, found), 4);  // of two modes in two blocks
  const auto modes = [&](std::size_t i) { return std::pair<int, int>(found[i][0], found[i][1]); };
  EXPECT_EQ(modes(0), std::pair(2, 0));  // 1 + 5
  EXPECT_EQ(modes(1), std::pair(0, 0));  // 0 + 5
  EXPECT_EQ(modes(2), std::pair(2, 2));
  EXPECT_EQ(modes(3), std::pair(0, 2));
}

TEST(NetworkProposer, RefusesWhatItWasNotTaughtOn) {
  const Integrator problem(DoubleIntegrator{}, bang_coast_bang(), {0.1, {1, 2}}, {});
  const Integrator longer(DoubleIntegrator{}, bang_coast_bang(), {0.1, {1, 3}}, {});
  const Integrator slower(DoubleIntegrator{}, bang_coast_bang(0.2), {0.1, {1, 2}}, {});
  NetworkProposer<DoubleIntegrator> proposer(constant_scores(problem, {1, 2}, {1}));
  EXPECT_NO_THROW(proposer.prepare(problem));
  EXPECT_THROW(proposer.prepare(longer), std::invalid_argument);
  EXPECT_THROW(proposer.prepare(slower), std::invalid_argument);
  EXPECT_THROW(NetworkProposer<DoubleIntegrator>(constant_scores(problem, {1, 2, 3}, {1})).prepare(problem),
               std::invalid_argument);
  EXPECT_THROW(NetworkProposer<DoubleIntegrator>(constant_scores(problem, {1, 2}, {3})).prepare(problem),
               std::invalid_argument);
  EXPECT_THROW(NetworkTailCost<DoubleIntegrator>(constant_scores(problem, {1, 2}, {1})).prepare(problem, 1),
               std::invalid_argument);
}

TEST(ProblemFeatures, SayTheSameOfTheLastBlocksAsOfAProblemThatHasNoOthers) {
  std::mt19937_64 random(14);
  for (int trial = 0; trial < 60; ++trial) {
    const Integrator problem = random_problem(random, trial, 4);
    Integrator rest(problem.model, problem.modes,
                    {0.1, {problem.horizon.blocks.begin() + 2, problem.horizon.blocks.end()}}, problem.cost);
    rest.initial = {uniform(random, -1, 1), uniform(random, -1, 1)};
    std::copy(problem.reference.end() - std::ssize(rest.reference), problem.reference.end(), rest.reference.begin());
    ProblemFeatures<DoubleIntegrator> late, whole;
    late.prepare(problem, 2);
    whole.prepare(rest);
    ASSERT_EQ(late.layout(), whole.layout());
    std::vector<float> a(late.size()), b(whole.size());
    late.write(problem, rest.initial, problem.lines, a);
    whole.write(rest, rest.initial, problem.lines, b);
    EXPECT_EQ(a, b);
  }
}

/// What the last block of a problem that weighs its end alone costs at best, in closed form: under a held force the
/// double integrator moves by v T + f T^2 / 2 and gains f T of speed.
class LastBlock final : public TailCost<DoubleIntegrator> {
 public:
  void prepare(const Integrator& problem, std::size_t first_block) override {
    ASSERT_EQ(first_block + 1, problem.horizon.blocks.size());
    time_ = 0.1 * problem.horizon.blocks.back();
  }
  double cost(const Integrator& problem, const StateOf<DoubleIntegrator>& x,
              const DelayLines& lines) noexcept override {
    double least = std::numeric_limits<double>::infinity();
    for (int mode = 0; mode < problem.modes.size(); ++mode) {
      const SwitchPattern pattern = problem.modes.pattern(mode);
      const double force = problem.modes.point(pattern)[0];
      const double y = x[0] + x[1] * time_ + force * time_ * time_ / 2 - problem.reference.back()[0];
      const double v = x[1] + force * time_ - problem.reference.back()[1];
      least = std::min(least, problem.cost.terminal[0] * y * y + problem.cost.terminal[1] * v * v +
                                  problem.cost.switching * std::popcount(pattern ^ lines.commanded()));
    }
    return least;
  }

 private:
  double time_ = 0.0;
};

TEST(TailSearch, FindsTheOptimumOfFourBlocksWhereTheLastOneCostsWhatItIsToldToCost) {
  std::mt19937_64 random(15);
  for (int trial = 0; trial < 200; ++trial) {
    Horizon horizon{0.1, {}};
    for (int b = 0; b < 4; ++b) horizon.blocks.push_back(1 + static_cast<int>(random() % 5));
    Integrator problem(
        DoubleIntegrator{}, bang_coast_bang(), horizon,
        {.terminal = {uniform(random, 0, 5), uniform(random, 0, 5)}, .switching = uniform(random, 0, 0.1)});
    problem.initial = {uniform(random, -1, 1), uniform(random, -1, 1)};
    problem.reference.back() = {uniform(random, -1, 1), uniform(random, -1, 1)};
    Exhaustive<DoubleIntegrator> oracle;
    oracle.prepare(problem);
    IntegratorPlan best(problem), plan(problem);
    const SolveReport optimum = oracle.solve(problem, best, Deadline::never());
    TailSearch<DoubleIntegrator> search(std::make_unique<LastBlock>(), 3);
    search.prepare(problem);
    const SolveReport report = search.solve(problem, plan, Deadline::never());
    EXPECT_NEAR(report.cost, optimum.cost, 1e-12);
    EXPECT_EQ(report.cost, evaluate(problem, plan).cost);
  }
}

/// The optimal cost of the blocks left, by search.
class Oracle final : public TailCost<DoubleIntegrator> {
 public:
  void prepare(const Integrator& problem, std::size_t first_block) override {
    rest_ = std::make_unique<Integrator>(
        problem.model, problem.modes,
        Horizon{
            0.1,
            {problem.horizon.blocks.begin() + static_cast<std::ptrdiff_t>(first_block), problem.horizon.blocks.end()}},
        problem.cost, problem.bounds);
    search_.prepare(*rest_);
    plan_ = IntegratorPlan(*rest_);
  }
  double cost(const Integrator& problem, const StateOf<DoubleIntegrator>& x,
              const DelayLines& lines) noexcept override {
    rest_->initial = x;
    rest_->lines = lines;
    std::copy(problem.reference.end() - std::ssize(rest_->reference), problem.reference.end(),
              rest_->reference.begin());
    return search_.solve(*rest_, plan_, Deadline::never()).cost;
  }

 private:
  std::unique_ptr<Integrator> rest_;
  Exhaustive<DoubleIntegrator> search_;
  IntegratorPlan plan_;
};

TEST(TailSearch, WithTheTrueCostTheFirstBlocksAreThoseOfAnOptimum) {
  std::mt19937_64 random(16);
  int found = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Integrator problem = random_problem(random, trial, 4);
    Exhaustive<DoubleIntegrator> search;
    search.prepare(problem);
    IntegratorPlan best(problem);
    const SolveReport optimum = search.solve(problem, best, Deadline::never());
    Oracle oracle;
    oracle.prepare(problem, 2);
    TailLanes<DoubleIntegrator> tree;
    tree.prepare(problem, 2, 9);
    SolveReport work;
    const auto first = tree.search(problem, best, work, Deadline::never(), [&](const auto& x, const DelayLines& lines) {
      return oracle.cost(problem, x, lines);
    });
    ASSERT_EQ(!first.empty(), optimum.status == Status::optimal);
    if (first.empty()) continue;
    ++found;
    double cost = std::numeric_limits<double>::infinity();  // of the best way to go on
    for (int last = 0; last < 9; ++last)
      cost = std::min(cost, cost_of(problem, {first[0][0], first[0][1], last / 3, last % 3}));
    EXPECT_NEAR(cost, optimum.cost, 1e-12);
  }
  EXPECT_GT(found, 150);
}

TEST(TailSearch, IsNeverWorseThanWarmStartAndHoldingWhateverItIsTold) {
  /// Says something.
  class Liar final : public TailCost<DoubleIntegrator> {
   public:
    void prepare(const Integrator&, std::size_t) override {}
    double cost(const Integrator&, const StateOf<DoubleIntegrator>& x, const DelayLines&) noexcept override {
      return std::abs(std::sin(1e3 * x[0] + x[1]));
    }
  };
  std::mt19937_64 random(17);
  for (int trial = 0; trial < 200; ++trial) {
    const std::size_t blocks = 2 + random() % 4;
    const Integrator problem = random_problem(random, trial, blocks);
    TailSearch<DoubleIntegrator> search(std::make_unique<Liar>(), 1 + static_cast<int>(random() % (blocks - 1)));
    search.prepare(problem);
    IntegratorPlan plan(problem);
    for (int& mode : plan.modes) mode = static_cast<int>(random() % 3);
    const double warm = cost_of(problem, plan.modes);
    const SolveReport report = search.solve(problem, plan, Deadline::never());
    EXPECT_LE(report.cost, warm);
    EXPECT_LE(report.cost, cost_of(problem, std::vector<int>(blocks, problem.modes.find(problem.lines.commanded()))));
    if (usable(report.status)) {
      EXPECT_EQ(report.cost, evaluate(problem, plan).cost);
    }
  }
}

TEST(TailSearch, StopsAtItsDeadlineWithThePlanItHas) {
  std::mt19937_64 random(19);
  for (int trial = 0; trial < 50; ++trial) {
    const Integrator problem = random_problem(random, trial, 4);
    TailSearch<DoubleIntegrator> search(std::make_unique<LastBlock>(), 3);
    search.prepare(problem);
    IntegratorPlan plan(problem);
    const double warm = cost_of(problem, plan.modes);
    const SolveReport report = search.solve(problem, plan, Deadline(Deadline::Clock::now() - std::chrono::seconds(1)));
    EXPECT_EQ(report.status, Status::deadline_reached);
    EXPECT_LE(report.nodes, 8) << "the warm start and holding, four blocks each";
    EXPECT_LE(report.cost, warm);
  }
}

TEST(TailSearch, RefusesMoreSequencesThanItHasRoomForHoweverMany) {
  // 3^64 would be another number in 64 bits, and 2^64 none.
  for (const int blocks : {14, 22, 32}) {
    const Integrator problem(DoubleIntegrator{}, bang_coast_bang(),
                             {0.1, std::vector<int>(static_cast<std::size_t>(blocks), 1)}, {});
    EXPECT_THROW(TailSearch<DoubleIntegrator>(std::make_unique<Oracle>(), blocks - 1).prepare(problem),
                 std::invalid_argument);
  }
}

TEST(TailSearch, RefusesWhatLeavesNothingToLearn) {
  const Integrator problem(DoubleIntegrator{}, bang_coast_bang(), {0.1, {1, 2}}, {});
  for (const int searched : {0, 2, 3})
    EXPECT_THROW(TailSearch<DoubleIntegrator>(std::make_unique<Oracle>(), searched).prepare(problem),
                 std::invalid_argument);
}

}  // namespace
}  // namespace solenoid
