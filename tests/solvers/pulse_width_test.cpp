// Pulses of whole steps through delayed switches: on-times follow what the relaxation wants, delays made up for.
#include "solvers/rounding/pulse_width.hpp"

#include "core/systems/actuator/prestabilised.hpp"
#include "core/systems/actuator/valves.hpp"
#include "solvers/rounding/relax_and_pulse.hpp"

#include <bit>
#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

constexpr double dt = 0.001;

/// A row of weights that commands the switches to `wish` in the mean: switch 0 alone, or 0 and 1 in modes that exclude
/// each other.
std::vector<double> row_for(const ModeSet& modes, double first, double second) {
  std::vector<double> row(static_cast<std::size_t>(modes.size()), 0.0);
  row[static_cast<std::size_t>(modes.find(1))] = first;
  row[static_cast<std::size_t>(modes.find(2))] = second;
  row[static_cast<std::size_t>(modes.find(0))] = 1.0 - first - second;
  return row;
}

struct Followed {
  double on = 0.0, wanted = 0.0;  ///< mean states in effect of switch 0
  int edges = 0;
};

/// Plans two intervals again and again, as a controller does, and follows the first of each plan.
Followed follow(const ModeSet& modes, const std::vector<double>& row, int interval, int periods) {
  const SwitchTiming timing(modes, dt);
  const RelaxedGrid grid{{interval, interval}};
  PulseWidth pulses;
  pulses.prepare(modes, timing, grid);
  std::vector<double> weights = row;
  weights.insert(weights.end(), row.begin(), row.end());
  const auto c = commanded_states<double>(modes, std::span<const double>(row));
  DelayLines lines(0);
  SwitchStates<double> owed{};
  std::vector<int> mode(static_cast<std::size_t>(2 * interval));
  std::vector<SwitchStates<double>> owes(mode.size());
  Followed f;
  for (int k = 0; k < periods; ++k) {
    for (int i = 0; i < interval; ++i)  // as the relaxed prediction has the first interval: after what is in flight
      f.wanted +=
          effective_state(static_cast<double>(lines.effective(i) & 1u), c[0], i, timing.rise[0], timing.fall[0]);
    pulses.round(modes, lines, weights, owed, mode, owes);
    for (int i = 0; i < interval; ++i) {
      const SwitchPattern pattern = modes.pattern(mode[static_cast<std::size_t>(i)]);
      EXPECT_TRUE(lines.may_command(pattern, timing));
      f.edges += std::popcount(pattern ^ lines.commanded());
      lines.command(pattern, timing);
      f.on += lines.effective() & 1u;
      lines.advance(1);
    }
    owed = owes[static_cast<std::size_t>(interval)];
  }
  f.on /= periods * interval, f.wanted /= periods * interval;
  return f;
}

TEST(PulseWidth, MeanOnTimeIsWhatTheRelaxationWantsDespiteDelays) {
  const ActuatorParameters p;  // 4 ms to energise, 1 ms to release
  for (const char* valves : {"three_way", "two_way"})
    for (const double duty : {0.0, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.93, 1.0}) {
      const ModeSet modes = valve_modes(valves, p);
      const Followed f = follow(modes, row_for(modes, duty, 0.0), 5, 400);
      EXPECT_NEAR(f.on, f.wanted, 0.01) << valves << " " << duty;
      if (duty == 0.0 || duty == 1.0) {
        EXPECT_LE(f.edges, 1);
      }
    }
}

TEST(PulseWidth, WithoutDelaysEveryPeriodKeepsItsDutyToAStep) {
  ActuatorParameters p;
  p.energise_delay_s = p.deenergise_delay_s = 0.0;
  for (const double duty : {0.2, 0.4, 0.6, 0.8}) {
    const ModeSet modes = valve_modes("three_way", p);
    const Followed f = follow(modes, row_for(modes, duty, 0.0), 5, 50);
    EXPECT_NEAR(f.on, duty, 0.01);
    EXPECT_LE(f.edges, 2 * 50 + 1);  // a pulse a period, and the first edge
  }
}

TEST(PulseWidth, ValvesThatExcludeEachOtherAreNeverOpenTogether) {
  const ModeSet modes = valve_modes("two_way", ActuatorParameters());
  ASSERT_LT(modes.find(3), 0);                                           // filling and exhausting chamber A
  EXPECT_GT(follow(modes, row_for(modes, 0.5, 0.5), 5, 200).edges, 10);  // every mode it gives is one of the set
}

TEST(PulseWidth, DelaysLongerThanAPeriodAreMadeUpForInLongerIntervals) {
  ActuatorParameters slow;
  slow.energise_delay_s = 0.010, slow.deenergise_delay_s = 0.003;
  const ModeSet modes = valve_modes("three_way", slow);
  for (const double duty : {0.3, 0.5, 0.7}) {
    const Followed f = follow(modes, row_for(modes, duty, 0.0), 10, 200);
    EXPECT_NEAR(f.on, f.wanted, 0.02) << duty;
  }
}

TEST(PulseWidth, LeastDwellsAreKept) {
  const ModeSet modes("dwelling", {{"valve", 0.0, 0.0, 0.003}}, {{"off", 0}, {"on", 1}}, {0.0}, {{1.0}});
  const std::vector<double> row = {0.55, 0.45};
  const Followed f = follow(modes, row, 5, 200);  // may_command() is expected of every step inside
  EXPECT_NEAR(f.on, f.wanted, 0.02);
  EXPECT_GT(f.edges, 50);
}

/// Hands out fractional weights that never change: the pulses are all there is to see.
class Fixed final : public RelaxedSolver<PneumaticActuator> {
 public:
  explicit Fixed(Status status) : status_(status) {}
  void prepare(const Problem<PneumaticActuator>& problem, const RelaxedGrid& grid) override {
    check_grid(problem, grid);
  }
  SolveReport solve(const Problem<PneumaticActuator>& problem, RelaxedPlan<PneumaticActuator>& plan,
                    Deadline) noexcept override {
    started_from = plan.weights;
    for (std::size_t k = 0; k < plan.intervals(); ++k) {
      const auto row = row_for(problem.modes, 0.3 + 0.02 * static_cast<double>(k), 0.0);
      std::ranges::copy(row, plan.row(k).begin());
    }
    SolveReport report;
    report.status = status_;
    return report;
  }
  std::vector<double> started_from;

 private:
  Status status_;
};

Problem<PneumaticActuator> pulsed_problem(double energise_s = 0.004) {
  ActuatorParameters p;
  p.energise_delay_s = energise_s;
  Cost<PneumaticActuator> cost;
  cost.tracking = {1.0, 0.0};
  Problem<PneumaticActuator> problem(PneumaticActuator(p), valve_modes("three_way", p), {dt, std::vector<int>(40, 1)},
                                     cost);
  problem.initial = {0.05, 0.0, 1.5e5, 1.5e5};
  for (auto& r : problem.reference) r = {0.06, 0.0};
  return problem;
}

TEST(RelaxAndPulse, TheRelaxationAndWhatIsOwedRideInTheWarmStart) {
  const auto problem = pulsed_problem();
  auto fixed = std::make_unique<Fixed>(Status::optimal);
  const Fixed& inside = *fixed;
  RelaxAndPulse<PneumaticActuator> solver(std::move(fixed), {.interval = 5});
  solver.prepare(problem);
  Plan<PneumaticActuator> plan(problem);
  const SolveReport first = solver.solve(problem, plan, Deadline::never());
  EXPECT_EQ(first.status, Status::feasible);  // pulses prove nothing
  EXPECT_EQ(first.cost, evaluate(problem, plan).cost);
  ASSERT_TRUE(plan.relaxation.known);
  EXPECT_NEAR(plan.relaxation.weights[static_cast<std::size_t>(problem.modes.find(1))], 0.3, 1e-12);
  const SwitchStates<double> owed = plan.relaxation.owed[5];
  shift_plan(problem.horizon, 5, plan);
  EXPECT_EQ(plan.relaxation.owed[0], owed);
  const Plan<PneumaticActuator> warm = plan;
  const SolveReport second = solver.solve(problem, plan, Deadline::never());
  EXPECT_NEAR(inside.started_from[static_cast<std::size_t>(problem.modes.find(1))], 0.32, 1e-12);  // an interval on
  Plan<PneumaticActuator> again = warm;
  EXPECT_EQ(solver.solve(problem, again, Deadline::never()).cost, second.cost);
  EXPECT_EQ(again.modes, plan.modes);
}

TEST(RelaxAndPulse, ARelaxationThatIsNoneStartsFromTheModes) {
  const auto problem = pulsed_problem();
  auto fixed = std::make_unique<Fixed>(Status::iteration_limit);
  const Fixed& inside = *fixed;
  RelaxAndPulse<PneumaticActuator> solver(std::move(fixed), {.interval = 5});
  solver.prepare(problem);
  Plan<PneumaticActuator> plan(problem);
  std::fill(plan.modes.begin(), plan.modes.end(), 2);
  plan.relaxation.known = true;  // of zeros, and then of no numbers
  EXPECT_EQ(solver.solve(problem, plan, Deadline::never()).status, Status::iteration_limit);
  EXPECT_EQ(inside.started_from[2], 1.0);
  std::fill(plan.relaxation.weights.begin(), plan.relaxation.weights.end(), std::nan(""));
  const int mode = plan.modes.front();
  solver.solve(problem, plan, Deadline::never());
  EXPECT_EQ(inside.started_from[static_cast<std::size_t>(mode)], 1.0);
}

TEST(RelaxAndPulse, WithoutARelaxationTheWarmStartStays) {
  const auto problem = pulsed_problem();
  RelaxAndPulse<PneumaticActuator> solver(std::make_unique<Fixed>(Status::infeasible), {.interval = 5});
  solver.prepare(problem);
  Plan<PneumaticActuator> plan(problem);
  std::fill(plan.modes.begin(), plan.modes.end(), 3);
  EXPECT_EQ(solver.solve(problem, plan, Deadline::never()).status, Status::infeasible);
  EXPECT_EQ(plan.modes, std::vector<int>(40, 3));
  EXPECT_FALSE(plan.relaxation.known);
}

TEST(RelaxAndPulse, IntervalsAreAsLongAsTheLongestDelay) {
  RelaxAndPulse<PneumaticActuator> solver(std::make_unique<Fixed>(Status::feasible), {.interval = 5});
  solver.prepare(pulsed_problem(0.010));
  EXPECT_EQ(solver.relaxed_plan().intervals(), 4u);
  EXPECT_THROW(solver.prepare(pulsed_problem(0.020)), std::invalid_argument);
  auto blocks = pulsed_problem();
  blocks.horizon.blocks = {20, 20};
  EXPECT_THROW(solver.prepare(blocks), std::invalid_argument);
}

}  // namespace
}  // namespace solenoid
