// The optimal dynamic quantiser: what quantising leaves in a plant's state is kept out of its outputs.
#include "solvers/rounding/dynamic_quantiser.hpp"

#include "solvers/rounding/delta_sigma.hpp"
#include "tests/support/modulated.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using test::modulated, test::Modulated, test::one_switch, test::step_s;

/// The largest and the root mean square of output 0's error of a plant under a modulator, for a duty that wanders.
std::pair<double, double> output_error(Modulator& modulator, const ModeSet& modes, const LinearPlant& plant, double low,
                                       double high) {
  const SwitchTiming timing(modes, step_s);
  const RelaxedGrid grid{std::vector<int>(400, 5)};
  modulator.prepare(modes, timing, grid);
  std::vector<double> weights;
  for (int k = 0; k < 400; ++k) {
    const double duty = 0.5 * (low + high) + 0.5 * (high - low) * std::sin(0.05 * k);
    weights.insert(weights.end(), {1.0 - duty, duty});
  }
  std::vector<int> mode(2000);
  std::vector<SwitchStates<double>> owed(2000), owed_sum(2000);
  modulator.round(modes, DelayLines(0), weights, {}, mode, owed, owed_sum);
  WantedStates wanted;
  wanted.prepare(timing, grid);
  wanted.read(modes, DelayLines(0), weights);
  std::vector<double> xi(plant.states, 0.0), next(plant.states);
  DelayLines lines(0);
  double most = 0.0, squares = 0.0;
  for (std::size_t j = 0; j < 2000; ++j) {
    lines.command(modes.pattern(mode[j]), timing);
    const double excess = static_cast<double>(lines.effective() & 1u) - wanted.at(j)[0];
    lines.advance(1);
    double z = 0.0;
    for (std::size_t i = 0; i < plant.states; ++i) {
      next[i] = push(plant, i, 0) * excess;
      for (std::size_t k = 0; k < plant.states; ++k) next[i] += plant.a[i * plant.states + k] * xi[k];
    }
    xi = next;
    for (std::size_t i = 0; i < plant.states; ++i) z += plant.c[i] * xi[i];
    most = std::max(most, std::abs(z)), squares += z * z;
  }
  return {most, std::sqrt(squares / 2000)};
}

TEST(DynamicQuantiser, OfAPlantOfFirstOrderIsOffByHalfOfWhatASwitchDoesInAStep) {
  // |C B| Delta / 2, the least that there is: theorem 1 of Azuma and Sugie 2008.
  LinearPlant lag(1, 1, 1);
  lag.a = {0.95}, lag.b = {0.05}, lag.c = {1.0}, lag.weight = {1.0};
  DynamicQuantiser quantiser(lag);
  DeltaSigma first(1);
  const double least = 0.5 * 0.05;
  EXPECT_LE(output_error(quantiser, one_switch(), lag, 0.1, 0.9).first, least * (1.0 + 1e-9));
  EXPECT_GT(output_error(first, one_switch(), lag, 0.1, 0.9).first, least * 1.1);
}

TEST(DynamicQuantiser, OnAPureIntegratorIsDeltaSigmaOfFirstOrder) {
  LinearPlant integrator(1, 1, 1);
  integrator.a = {1.0}, integrator.b = {1.0}, integrator.c = {1.0}, integrator.weight = {1.0};
  DynamicQuantiser quantiser(integrator);
  DeltaSigma first(1);
  for (const auto& modes : {one_switch(), one_switch(0.004, 0.001)}) {
    const Modulated a = modulated(quantiser, modes, 0.37, 1000, 5), b = modulated(first, modes, 0.37, 1000, 5);
    EXPECT_EQ(a.error, b.error);
    for (std::size_t j = 0; j < 1000; ++j) ASSERT_NEAR(a.owed[j], b.owed[j], 1e-9);
  }
}

TEST(DynamicQuantiser, BeatsDeltaSigmaOfFirstOrderInThePlantsOutput) {
  LinearPlant oscillator(2, 1, 1);
  oscillator.a = {1.0, 0.1, -0.1, 0.9}, oscillator.b = {0.0, 0.1}, oscillator.c = {1.0, 0.0}, oscillator.weight = {1.0};
  EXPECT_EQ(DynamicQuantiser::relative_degree(oscillator, 8), 2);
  LinearPlant chain(3, 1, 2);
  chain.a = {1.0, 0.1, 0.0, 0.0, 0.99, 0.1, 0.0, 0.0, 0.97}, chain.b = {0.0, 0.0, 0.1};
  chain.c = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0}, chain.weight = {1.0, 0.1};
  EXPECT_EQ(DynamicQuantiser::relative_degree(chain, 8), 3);
  for (const LinearPlant& plant : {oscillator, chain}) {
    DynamicQuantiser quantiser(plant);
    DeltaSigma first(1);
    EXPECT_LT(output_error(quantiser, one_switch(), plant, 0.15, 0.85).second,
              output_error(first, one_switch(), plant, 0.15, 0.85).second);
  }
  DynamicQuantiser quantiser(chain);
  DeltaSigma first(1);
  const ModeSet delayed = one_switch(0.004, 0.001);
  EXPECT_LT(output_error(quantiser, delayed, chain, 0.15, 0.85).second,
            0.5 * output_error(first, delayed, chain, 0.15, 0.85).second);
}

}  // namespace
}  // namespace solenoid
