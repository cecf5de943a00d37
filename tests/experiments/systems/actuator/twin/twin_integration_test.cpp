#include "core/systems/actuator/signals.hpp"
#include "tests/experiments/systems/actuator/twin/twin_support.hpp"

#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

TwinParameters integrated(TwinParameters p, Integration method, int steps, double tolerance = 1e-10) {
  p.integration = {method, steps, tolerance};
  return p;
}

/// States at every tick under seeded commands that reach the end stops, stick and slip.
std::vector<ActuatorState> driven(const TwinParameters& parameters, double duration_s, std::uint64_t seed,
                                  const std::string& valves = "three_way") {
  TwinPlant plant(parameters, valves, 0.05, {false, false, 1});
  const ModeSet modes = valve_modes(valves, parameters.actuator);
  std::mt19937_64 random(seed);
  std::vector<ActuatorState> states;
  for (int k = 0; k <= static_cast<int>(1000 * duration_s); ++k) {
    states.push_back(actuator_state(plant.read(1e-3 * k).truth));
    if (k % 5 != 0) continue;
    const int mode = static_cast<int>(random() % static_cast<std::uint64_t>(modes.size()));
    plant.write({modes.pattern(mode), 8.0 * (static_cast<double>(random() % 3) - 1.0)});
  }
  return states;
}

double largest_gap(const std::vector<ActuatorState>& a, const std::vector<ActuatorState>& b, std::size_t which) {
  double gap = 0;
  for (std::size_t k = 0; k < a.size(); ++k) gap = std::max(gap, std::abs(a[k][which] - b[k][which]));
  return gap;
}

// The stated tolerance of the mode that campaigns use over seconds of random switching: below a step of the converters.
void expect_within_tolerance(const std::vector<ActuatorState>& a, const std::vector<ActuatorState>& b) {
  EXPECT_LT(largest_gap(a, b, position), 1e-5);
  EXPECT_LT(largest_gap(a, b, velocity), 2e-4);
  EXPECT_LT(largest_gap(a, b, pressure_a), 100.0);
  EXPECT_LT(largest_gap(a, b, pressure_b), 100.0);
}

TEST(TwinIntegration, FixedStepsAgreeWithAdaptiveAndWithVeryFineOnes) {
  for (const TwinParameters& twin : {full_twin(), nominal_twin()}) {
    const auto fixed = driven(integrated(twin, Integration::fixed, 1), 2.0, 11);
    const auto fine = driven(integrated(twin, Integration::fixed, 40), 2.0, 11);
    const auto adaptive = driven(integrated(twin, Integration::adaptive, 1), 2.0, 11);
    expect_within_tolerance(fixed, adaptive);
    expect_within_tolerance(fixed, fine);
    EXPECT_LT(largest_gap(fine, adaptive, position), 2e-7);
  }
}

TEST(TwinIntegration, FixedStepsAgreeWithAdaptiveUnderStickSlipAndEndStops) {
  TwinParameters twin = full_twin();
  twin.friction.law = FrictionLaw::model;
  bool stuck = false;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const auto adaptive = driven(integrated(twin, Integration::adaptive, 1), 1.5, seed, "two_way");
    expect_within_tolerance(driven(integrated(twin, Integration::fixed, 4), 1.5, seed, "two_way"), adaptive);
    for (const ActuatorState& x : adaptive) {
      const bool end = x[position] <= twin.actuator.position_min_m() || x[position] >= twin.actuator.position_max_m();
      stuck = stuck || (!end && x[velocity] == 0.0);
    }
  }
  EXPECT_TRUE(stuck);
}

TEST(TwinIntegration, ConvergesWithTheSquareOfTheStep) {
  const TwinParameters twin = full_twin();
  const auto exact = driven(integrated(twin, Integration::adaptive, 1, 1e-12), 1.0, 5);
  double previous = 0;
  for (const int steps : {2, 4, 8, 16}) {
    const double gap = largest_gap(driven(integrated(twin, Integration::fixed, steps), 1.0, 5), exact, position);
    if (previous > 0) {
      EXPECT_GT(previous / gap, 3.0) << steps;
    }
    previous = gap;
  }
}

TEST(TwinIntegration, AdaptiveErrorFollowsItsTolerance) {
  const TwinParameters twin = full_twin();
  const auto exact = driven(integrated(twin, Integration::adaptive, 1, 1e-12), 0.5, 5);
  const double rough = largest_gap(driven(integrated(twin, Integration::adaptive, 1, 1e-6), 0.5, 5), exact, position);
  const double fine = largest_gap(driven(integrated(twin, Integration::adaptive, 1, 1e-9), 0.5, 5), exact, position);
  EXPECT_LT(rough, 1e-5);
  EXPECT_LT(fine, 1e-7);
  EXPECT_LT(fine, rough);
}

/// The controller's model in steps of dt under the coils of a script, one pattern each 5 ms, delays of 4 and 1 ms.
ActuatorState model_after(const ActuatorParameters& p, const std::vector<SwitchPattern>& script, double motor_n,
                          double dt) {
  const PneumaticActuator model(p);
  const ModeSet modes = valve_modes("three_way", p);
  const auto per_ms = static_cast<int>(std::lround(1e-3 / dt));
  const SwitchTiming timing(modes, 1e-3);
  DelayLines lines(0);
  ActuatorState x{0.05, 0.0, p.atmospheric_pressure_pa, p.atmospheric_pressure_pa};
  for (std::size_t ms = 0; ms < 5 * script.size(); ++ms) {
    if (ms % 5 == 0) lines.command(script[ms / 5], timing);
    Openings opening;
    const auto point = modes.point(lines.effective());
    std::copy(point.begin(), point.end(), opening.begin());
    for (int i = 0; i < per_ms; ++i) x = model.step<double>(x, opening, {motor_n}, dt);
    lines.advance(1);
  }
  return x;
}

TEST(TwinIntegration, WithAllEffectsOffItIsTheControllersModelInTheLimitOfSmallSteps) {
  for (const Integration method : {Integration::fixed, Integration::adaptive}) {
    for (const std::uint64_t seed : {1, 2, 3, 4}) {
      TwinParameters twin = integrated({}, method, method == Integration::fixed ? 20 : 1);
      if (seed == 4) twin.actuator.plane = Plane::horizontal;
      std::mt19937_64 random(seed);
      std::vector<SwitchPattern> script;
      for (int i = 0; i < 80; ++i) script.push_back(static_cast<SwitchPattern>(random() % 4));
      TwinPlant plant(twin, "three_way", 0.05, {false, false, 1});
      for (std::size_t i = 0; i < script.size(); ++i) {
        plant.read(5e-3 * static_cast<double>(i));
        plant.write({script[i], 3.0});
      }
      const ActuatorState ours = actuator_state(plant.read(5e-3 * static_cast<double>(script.size())).truth);
      // The model's steps are of first order: the gap shrinks with dt, and extrapolates to nothing.
      const ActuatorState coarse = model_after(twin.actuator, script, 3.0, 2e-6);
      const ActuatorState fine = model_after(twin.actuator, script, 3.0, 1e-6);
      for (std::size_t i = 0; i < 4; ++i) {
        const double scale = twin_scale[i];
        EXPECT_NEAR(ours[i], fine[i], 2e-4 * scale) << "state " << i << " seed " << seed;
        EXPECT_NEAR(ours[i], 2 * fine[i] - coarse[i], 6e-5 * scale) << "state " << i << " seed " << seed;
      }
    }
  }
}

TEST(TwinIntegration, EndStopsHoldUntilTheForceTurns) {
  for (const char* friction : {"model", "lugre"}) {
    for (const Integration method : {Integration::fixed, Integration::adaptive}) {
      TwinParameters twin = integrated(twin_from("friction = { law = \"" + std::string(friction) + "\" }"), method, 1);
      TwinBench bench(twin, "three_way", 0.08);
      bench.command(1);  // A fills, B exhausts
      bench.run(2.0);
      EXPECT_EQ(bench.state[position], twin.actuator.position_max_m());
      EXPECT_EQ(bench.state[velocity], 0.0);
      bench.command(2);
      bench.run(2.0);
      EXPECT_EQ(bench.state[position], twin.actuator.position_min_m());
      EXPECT_EQ(bench.state[velocity], 0.0);
    }
  }
}

}  // namespace
}  // namespace solenoid
