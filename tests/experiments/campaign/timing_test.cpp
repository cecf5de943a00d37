#include "controllers/factory.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulate.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// The thesis's law on a second of the cycloid's first move, sampled as a test wants it.
RunResult run_of(const TimingKeys& of_variant, const TimingKeys& of_scenario) {
  VariantConfig variant = shipped_variant("thesis_pd");
  variant.own_timing = of_variant;
  ScenarioConfig scenario;
  scenario.name = "short";
  scenario.trajectory = Trajectory(0.0197).cycloid_to(0.05, 1.0);
  scenario.duration_s = 1.0;
  scenario.timing = of_scenario;
  return simulate(variant, scenario, 1);
}

int solves_of(const RunResult& run) {
  int solves = 0;
  for (const TickRecord& tick : run.ticks) solves += tick.decision.solved;
  return solves;
}

struct SamplingCase {
  TimingKeys of_variant, of_scenario;
  std::size_t ticks;
  int solves;
};

class Sampling : public testing::TestWithParam<SamplingCase> {};

TEST_P(Sampling, IsTheVariantsThenTheScenariosThenTheSystems) {
  const auto& [of_variant, of_scenario, ticks, solves] = GetParam();
  const RunResult run = run_of(of_variant, of_scenario);
  ASSERT_EQ(run.ticks.size(), ticks);
  EXPECT_EQ(solves_of(run), solves);
  for (std::size_t k = 0; k < ticks; ++k)
    EXPECT_NEAR(run.ticks[k].sensors.time_s, static_cast<double>(k) / static_cast<double>(ticks), 1e-12);
  EXPECT_LT(run.metrics["rmse_mm"], 0.5);
}

INSTANTIATE_TEST_SUITE_P(All, Sampling,
                         testing::Values(SamplingCase{{}, {}, 1000, 200}, SamplingCase{{}, {{}, 10.0}, 1000, 100},
                                         SamplingCase{{{}, 20.0}, {{}, 10.0}, 1000, 50},
                                         SamplingCase{{0.5, 2.5}, {}, 2000, 400},
                                         SamplingCase{{0.5, {}}, {{}, 10.0}, 2000, 100},
                                         SamplingCase{{1.0, 1.0}, {}, 1000, 1000}));

TEST(SamplingOfTheSystem, SaidOutrightChangesNothing) {
  const RunResult silent = run_of({}, {}), said = run_of({1.0, 5.0}, {});
  ASSERT_EQ(silent.ticks.size(), said.ticks.size());
  for (std::size_t k = 0; k < said.ticks.size(); ++k)
    ASSERT_EQ(said.ticks[k].sensors.truth, silent.ticks[k].sensors.truth);
}

}  // namespace
}  // namespace solenoid
