// Limits by keys of a variant: what a problem gets of them, what is refused, and that a problem without a plan within them
// takes the ladder down, in words.
#include "controllers/factory.hpp"
#include "controllers/systems.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/rt/recorder.hpp"
#include "core/safety/broken_limit_text.hpp"
#include "core/systems/actuator/dynamics.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/rig/background.hpp"
#include "experiments/rig/late_solver.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "tests/support/variant_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string with_limits(const std::string& limits, const std::string& rest) {
  return "valves = 'two_way'\nsolver = 'branch_and_bound'\n" + rest + "[limits]\n" + limits;
}
VariantConfig limited(const std::string& limits) { return test::variant_of(with_limits(limits, "")); }
std::string refused(const std::string& limits, const std::string& rest = "") {
  return test::refusal_of(with_limits(limits, rest));
}

TEST(LimitKeys, ReachTheModeSetAndTheProblem) {
  const VariantConfig v = limited(
      "least_on_ms = 8\nleast_off_ms = 3.5\nmost_changes = 5\nwindow_ms = 200\nleast_position_m = 0.01\n"
      "most_position_m = 0.09\nmost_velocity_m_s = 0.3\npenalty_velocity = 2.5\nmost_pressure_b_pa = 2.2e5\n");
  const std::unique_ptr<AnyProblem> any = system_of(v).problem(v);
  const SwitchTiming timing(any->modes, v.timing.tick_s);
  for (std::size_t c = 0; c < 4; ++c) {
    EXPECT_EQ(timing.least(c, true), 8);
    EXPECT_EQ(timing.least(c, false), 4);  // never shorter than asked
    EXPECT_EQ(timing.max_changes[c], 5);
    EXPECT_EQ(timing.window[c], 200);
  }
  const auto& bounds = dynamic_cast<const Problem<PneumaticActuator>&>(*any).bounds;
  constexpr double inf = std::numeric_limits<double>::infinity();
  EXPECT_THAT(bounds.state_lower, testing::ElementsAre(0.01, -inf, -inf, -inf));
  EXPECT_THAT(bounds.state_upper, testing::ElementsAre(0.09, 0.3, inf, 2.2e5));
  EXPECT_THAT(bounds.state_penalty, testing::ElementsAre(0, 2.5, 0, 0));
  EXPECT_FALSE(bounds.breaks(velocity, 1.0));
  EXPECT_TRUE(bounds.breaks(position, 0.1));
}

TEST(LimitKeys, AreRefusedByName) {
  const auto says = [](const char* key, const char* what) {
    return AllOf(HasSubstr("mine.toml"), HasSubstr(key), HasSubstr(what), HasSubstr("allowed"));
  };
  EXPECT_THAT(refused("most_changes = 3\n"), says("limits.window_ms", "missing"));
  EXPECT_THAT(refused("window_ms = 3\n"), says("limits.most_changes", "missing"));
  EXPECT_THAT(refused("least_position_m = 0.1\nmost_position_m = 0.05\n"), says("limits.most_position_m", "0.1"));
  EXPECT_THAT(refused("penalty_position = 1\n"), says("limits.penalty_position", "softens nothing"));
  EXPECT_THAT(refused("least_on_ms = 100\n"), says("limits", "min_on"));
  EXPECT_THAT(refused("least_on_ms = -1\n"), says("limits.least_on_ms", "above 0"));
  EXPECT_THAT(refused("most_changes = 20\nwindow_ms = 100\n"), says("limits", "80 changes"));
  EXPECT_THAT(refused("least_angle = 1\n"), says("least_angle", "not"));
  EXPECT_THAT(refused("least_on_ms = 8\n", "motor = 'in_prediction'\nhorizon = { steps = 40 }\n"), "accepted");
  EXPECT_THAT(test::refusal_of("valves = 'two_way'\nsolver = 'sqp'\nhorizon = { steps = 40 }\n"
                               "limits = { least_on_ms = 8 }\n"),
              says("limits", ""));
}

/// The arm has to go where a bound does not let it; what comes of it stays within what the words say.
TEST(LimitKeys, WithoutAPlanTheLadderTakesOverAndSaysWhy) {
  const Campaign campaign = read_campaign("rig", {{"nine_robust"}, {"cycloidal"}});
  const ScenarioConfig& scenario = campaign.scenarios.front();
  VariantConfig variant = told(campaign.variants.front(), scenario);
  variant.limits.most[position] = scenario.trajectory.axes().front().start() - 0.002;  // where it stands is beyond
  const std::unique_ptr<SimulatedPlant> plant = make_plant(variant, scenario, 1);
  const auto ladder = make_ladder(variant, scenario.trajectory, system_of(variant).ladder(variant));
  CommandLimits limits = make_limits(variant);
  MemoryRecorder recorder(1000);
  FakeClock clock;
  ControlLoop loop(*plant, clock, *ladder, limits, recorder);
  loop.run(400, variant.timing.tick_s);
  const LadderCounts& counts = ladder->counts();
  EXPECT_GT(counts.infeasible, 70);
  EXPECT_GT(counts.slots[static_cast<std::size_t>(Rung::held)], 70);
  EXPECT_LE(counts.slots[static_cast<std::size_t>(Rung::fresh)], 1);  // before the first sample is believed
  EXPECT_EQ(counts.first_broken.kind, BrokenLimit::Kind::state);
  const std::string words = broken_limit_text(counts.first_broken, system_of(variant).description(),
                                              system_of(variant).modes(variant), variant.timing.tick_s);
  EXPECT_THAT(words, AllOf(HasSubstr("position 0.0"), HasSubstr("beyond its bound of 0.0"), HasSubstr("1 ms ahead")));
}

// Plans that arrive after others have been given in their place, or as what is left of a bank that lost a coil: no command breaks the
// least times all the same, whichever rung it is of, but those that turn everything off.
TEST(LimitKeys, LatePlansKeepTheLeastTimesToo) {
  const Campaign campaign = read_campaign("rig", {{"nine_robust"}, {"cycloidal"}});
  const ScenarioConfig& scenario = campaign.scenarios.front();
  VariantConfig variant = told(campaign.variants.front(), scenario);
  variant.limits.least_on_ms = variant.limits.least_off_ms = 30.0;
  const std::unique_ptr<SimulatedPlant> plant = make_plant(variant, scenario, 1);
  const double tick_s = variant.timing.tick_s;
  const auto late =
      faults_of_solver(parse_faults({"solver:late=6@1+1.5", "solver:late=30@2.6+1"}, actuator_simulation()));
  const auto ladder =
      make_ladder(variant, scenario.trajectory, system_of(variant).ladder(variant),
                  [&](AnySolverPtr solver) { return std::make_unique<LateSolver>(std::move(solver), late, tick_s); });
  CommandLimits limits = make_limits(variant);
  MemoryRecorder recorder(5000);
  FakeClock clock;
  ControlLoop loop(*plant, clock, *ladder, limits, recorder);
  loop.run(4500, tick_s);
  std::array<std::int64_t, 4> changed{-1000, -1000, -1000, -1000};
  SwitchPattern before = 0;
  int changes = 0, early = 0, held = 0;
  for (std::int64_t k = 0; k < static_cast<std::int64_t>(recorder.records().size()); ++k) {
    const TickRecord& t = recorder.records()[static_cast<std::size_t>(k)];
    const bool planned = t.decision.rung <= Rung::held;
    held += t.decision.rung == Rung::held;
    for (std::size_t c = 0; c < 4; ++c) {
      if (((t.applied.switches ^ before) >> c & 1u) == 0) continue;
      ++changes;
      early += planned && k - changed[c] < 30;
      changed[c] = k;
    }
    before = t.applied.switches;
  }
  EXPECT_GT(changes, 30);
  EXPECT_GT(held, 100);
  EXPECT_EQ(early, 0);
}

TEST(LimitKeys, EveryBrokenLimitHasWords) {
  const VariantConfig v = limited("most_changes = 5\nwindow_ms = 200\n");
  const ModeSet modes = system_of(v).modes(v);
  const auto text = [&](BrokenLimit broken) {
    return broken_limit_text(broken, system_of(v).description(), modes, 0.001);
  };
  using Kind = BrokenLimit::Kind;
  EXPECT_EQ(text({}), "");
  EXPECT_EQ(text({Kind::dwell, 5, 2, 3, 8}),
            "coil 'supply B' changes 3 ms after its last change, of 8 ms at least, 5 ms ahead");
  EXPECT_EQ(text({Kind::window, 0, 1, 5, 5}),
            "coil 'exhaust A' has changed 5 times in 200 ms, of 5 at most, 0 ms ahead");
  EXPECT_EQ(text({Kind::state, 12, 0, 0.1002, 0.1}), "position 0.1002 m beyond its bound of 0.1 m, 13 ms ahead");
  EXPECT_THAT(text({Kind::one_at_a_time, 0, 0, 2, 1}), HasSubstr("more than one coil of a group"));
}

}  // namespace
}  // namespace solenoid
