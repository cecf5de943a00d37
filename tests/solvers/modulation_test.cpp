// Modulators cut relaxed switch states into single steps: errors that stay bounded, noise out of the way of slow
// plants.
#include "core/systems/actuator/valves.hpp"
#include "solvers/rounding/delta_sigma.hpp"
#include "solvers/rounding/dynamic_quantiser.hpp"
#include "solvers/rounding/pulse_width.hpp"
#include "tests/support/modulated.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using test::modulated, test::Modulated, test::one_switch, test::random_rows, test::step_s;

double largest(const std::vector<double>& values) {
  double most = 0.0;
  for (const double v : values) most = std::max(most, std::abs(v));
  return most;
}

const std::vector<double> duties = {0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.93};

TEST(DeltaSigma, OrdersAreOneAndTwo) {
  EXPECT_THROW(DeltaSigma(0), std::invalid_argument);
  EXPECT_THROW(DeltaSigma(3), std::invalid_argument);
}

TEST(DeltaSigma, OfFirstOrderOwesHalfAStepAtMost) {
  std::mt19937_64 random(1);
  DeltaSigma modulator(1);
  const ModeSet modes = one_switch();
  const SwitchTiming timing(modes, step_s);
  const RelaxedGrid grid{std::vector<int>(500, 1)};
  modulator.prepare(modes, timing, grid);
  std::vector<int> mode(500);
  std::vector<SwitchStates<double>> owed(500), owed_sum(500);
  for (int trial = 0; trial < 50; ++trial) {  // of any wanted signal, not of constants alone
    std::vector<double> weights;
    for (int j = 0; j < 500; ++j) {
      const double duty = uniform(random, 0.0, 1.0);
      weights.insert(weights.end(), {1.0 - duty, duty});
    }
    modulator.round(modes, DelayLines(0), weights, {}, mode, owed, owed_sum);
    for (std::size_t j = 0; j < 500; ++j) ASSERT_LE(std::abs(owed[j][0]), 0.5 + 1e-9) << j;
  }
}

TEST(DeltaSigma, MeanIsTheDutyWithinAStepInAllOfThem) {
  constexpr int steps = 4000;
  for (const int order : {1, 2})
    for (const double duty : duties) {
      DeltaSigma modulator(order);
      const Modulated m = modulated(modulator, one_switch(), duty, steps, 5);
      double sum = 0.0;
      for (const double e : m.error) sum += e;
      EXPECT_LE(std::abs(sum / steps), 1.0 / steps) << order << " " << duty;
    }
}

TEST(DeltaSigma, ThroughDelaysTheMeanIsWhatIsWantedAndTheErrorHalfAPause) {
  // 4 steps to rise and 1 to fall: a pause is in effect for 4 steps at least, so that half of one is owed and what the
  // step at hand wants.
  constexpr int steps = 4000;
  for (const double duty : duties) {
    DeltaSigma modulator(1);
    const Modulated m = modulated(modulator, one_switch(0.004, 0.001), duty, steps, 5);
    double sum = 0.0;
    for (const double e : m.error) sum += e;
    EXPECT_LE(std::abs(sum), 2.0) << duty;
    EXPECT_LE(largest(m.owed), 2.0) << duty;
    PulseWidth pulses;
    EXPECT_LE(m.edges, modulated(pulses, one_switch(0.004, 0.001), duty, steps, 5).edges * 1.1) << duty;
  }
}

TEST(DeltaSigma, OfSecondOrderKeepsTheSumOfWhatIsOwedBounded) {
  // Both states of the loop in units of half a step, x1 and x2 of S. Hein, A. Zakhor, "On the stability of sigma delta
  // modulators", IEEE Transactions on Signal Processing 41 (1993) 2322-2348: for a constant input |u| < 1
  //     |x1| <= |u| + 2,    |x2| <= (5 - |u|)^2 / (8 (1 - |u|)),    owed_sum = x2 - sign(x2) there
  int within = 0;
  for (const double duty : duties) {
    DeltaSigma modulator(2);
    const Modulated m = modulated(modulator, one_switch(), duty, 20000, 5);
    const double u = std::abs(2.0 * duty - 1.0);
    const double x2 = (5.0 - u) * (5.0 - u) / (8.0 * (1.0 - u));
    EXPECT_LE(largest(m.owed), 0.5 * (2.0 * u + 2.0)) << duty;
    if (0.5 * (x2 - 1.0) > modulator.most().owed_sum[0]) continue;  // cut off before
    EXPECT_LE(largest(m.owed_sum), std::max(0.5, 0.5 * (x2 - 1.0)) + 1e-9) << duty;
    ++within;
  }
  EXPECT_GE(within, 4);
}

/// The mean power of the error over a band, 0 to `to` of the sampling frequency, each bin a direct sum under Hann's
/// window: what is cut off at the ends does not leak into the band.
double power(const std::vector<double>& error, double to) {
  const auto n = static_cast<double>(error.size());
  const int bins = static_cast<int>(to * n);
  double sum = 0.0;
  for (int k = 1; k <= bins; ++k) {
    const std::complex<double> turn = std::polar(1.0, -2.0 * std::numbers::pi * k / n);
    std::complex<double> at = 1.0, bin = 0.0;
    for (std::size_t j = 0; j < error.size(); ++j, at *= turn)
      bin += error[j] * (1.0 - std::cos(2.0 * std::numbers::pi * static_cast<double>(j) / n)) * at;
    sum += std::norm(bin) / n;
  }
  return sum / bins;
}

TEST(DeltaSigma, NoiseLeavesTheLowFrequenciesByTheOrder) {
  // A busy signal leaves the quantiser's own error white, and in the band the shape is |1 - z^-1|^(2 L): what is left
  // of it grows by 4^L with each doubling of the band.
  std::mt19937_64 random(24);
  std::vector<double> duties(8192);
  for (double& duty : duties) duty = uniform(random, 0.3, 0.7);
  for (const int order : {1, 2}) {
    DeltaSigma modulator(order);
    const Modulated m = modulated(modulator, one_switch(), duties, 1);
    const double three_doublings = power(m.error, 0.1) / power(m.error, 0.0125);
    EXPECT_NEAR(std::log(three_doublings) / std::log(4.0) / 3.0, order, 0.25);
  }
}

/// A plant with two states for any number of switches.
LinearPlant some_plant(int switches) {
  LinearPlant plant(2, static_cast<std::size_t>(switches), 1);
  plant.a = {1.0, 0.1, 0.0, 0.95};
  for (std::size_t c = 0; c < plant.switches; ++c) plant.b[plant.switches + c] = c % 2 == 0 ? 0.1 : -0.1;
  plant.c = {1.0, 0.0};
  plant.weight = {1.0};
  return plant;
}

TEST(Modulators, CommandOnlyWhatDwellsGroupsWindowsAndModesAllow) {
  std::mt19937_64 random(22);
  ActuatorParameters slow;
  slow.energise_delay_s = 0.003;
  std::vector<ModeSet> sets = {valve_modes("two_way", slow), valve_modes("seven_mode", slow),
                               one_switch(0, 0, 0.007, 0.003)};
  sets.push_back(
      valve_modes("two_way", slow).with_switches({4, Switch{"valve", 0.002, 0.001, 0.002, 0.004, 0.003, 3, 0.02}}));
  sets.push_back(
      {"levels", {{"up", 0.0, 0.0}, {"down", 0.0, 0.0}}, {{"-", 2}, {"0", 0}, {"+", 1}}, {0.0}, {{1.0}, {-1.0}}, {3}});
  for (const ModeSet& modes : sets) {
    const SwitchTiming timing(modes, step_s);
    const RelaxedGrid grid{std::vector<int>(8, 5)};
    PulseWidth pulses;
    DeltaSigma first(1), second(2);
    DynamicQuantiser quantiser(some_plant(modes.switch_count()));
    for (Modulator* modulator : std::initializer_list<Modulator*>{&pulses, &first, &second, &quantiser}) {
      modulator->prepare(modes, timing, grid);
      std::vector<int> mode(40), again(40);
      std::vector<SwitchStates<double>> owed(40), owed_sum(40);
      DelayLines lines(modes.safe_pattern());
      ModulatorState state;
      int changes = 0;
      for (int problem = 0; problem < 60; ++problem) {
        const std::vector<double> weights = random_rows(random, modes.size(), 8);
        modulator->round(modes, lines, weights, state, mode, owed, owed_sum);
        DelayLines ahead = lines;
        for (std::size_t j = 0; j < 40; ++j) {
          const SwitchPattern pattern = modes.pattern(mode.at(j));
          ASSERT_TRUE(ahead.may_command(pattern, timing)) << modes.name() << " step " << j;
          changes += pattern != ahead.commanded();
          ahead.command(pattern, timing);
          ahead.advance(1);
          if (j < 5) lines = ahead;
        }
        modulator->round(modes, DelayLines(modes.safe_pattern()), random_rows(random, modes.size(), 8), {}, again, owed,
                         owed_sum);
        state = {owed[5], owed_sum[5]};
      }
      EXPECT_GT(changes, 60) << modes.name();
    }
  }
}

TEST(Modulators, TheSameProblemGivesTheSameModesWhateverWasRoundedBefore) {
  std::mt19937_64 random(23);
  const ModeSet modes = valve_modes("two_way", ActuatorParameters());
  const SwitchTiming timing(modes, step_s);
  const RelaxedGrid grid{std::vector<int>(8, 5)};
  PulseWidth pulses;
  DeltaSigma first(1), second(2);
  DynamicQuantiser quantiser(some_plant(4));
  for (Modulator* modulator : std::initializer_list<Modulator*>{&pulses, &first, &second, &quantiser}) {
    modulator->prepare(modes, timing, grid);
    std::vector<int> mode(40), again(40);
    std::vector<SwitchStates<double>> owed(40), owed_sum(40), owed_again(40), sum_again(40);
    ModulatorState state;
    state.owed[0] = 0.7, state.owed_sum[2] = -1.3;
    const std::vector<double> weights = random_rows(random, modes.size(), 8);
    modulator->round(modes, DelayLines(0), weights, state, mode, owed, owed_sum);
    EXPECT_EQ(owed[0], state.owed);  // as the problem begins
    modulator->round(modes, DelayLines(1), random_rows(random, modes.size(), 8), {}, again, owed_again, sum_again);
    modulator->round(modes, DelayLines(0), weights, state, again, owed_again, sum_again);
    EXPECT_EQ(again, mode);
    EXPECT_EQ(owed_again, owed);
    EXPECT_EQ(sum_again, owed_sum);
  }
}

TEST(Modulators, AnEdgePriceSparesEdgesAndKeepsTheMean) {
  LinearPlant integrator(1, 1, 1);
  integrator.a = integrator.b = integrator.c = integrator.weight = {1.0};
  for (const double duty : {0.2, 0.35, 0.5, 0.7})
    for (const bool of_the_plant : {false, true}) {
      int before = std::numeric_limits<int>::max();
      for (const double price : {0.0, 2.0, 8.0}) {
        DeltaSigma first(1, price);
        DynamicQuantiser quantiser(integrator, price);
        Modulator& modulator = of_the_plant ? static_cast<Modulator&>(quantiser) : first;
        const Modulated m = modulated(modulator, one_switch(0.004, 0.001), duty, 4000, 5);
        double sum = 0.0;
        for (const double e : m.error) sum += e;
        EXPECT_LE(std::abs(sum), 3.0 + 0.5 * price) << duty << " " << price;  // what may be owed
        EXPECT_LT(m.edges, before) << duty << " " << price;
        EXPECT_GT(m.edges, 50) << duty << " " << price;
        before = m.edges;
      }
    }
}

TEST(DeltaSigma, APlanGoesOnWhereTheLastOneLeftOff) {
  // Round after round over the first interval of each is one round over all of them.
  for (const int order : {1, 2}) {
    const ModeSet modes = one_switch();
    DeltaSigma modulator(order);
    const Modulated whole = modulated(modulator, modes, 0.37, 500, 5);
    const SwitchTiming timing(modes, step_s);
    modulator.prepare(modes, timing, {{5, 5}});
    std::vector<int> mode(10);
    std::vector<SwitchStates<double>> owed(10), owed_sum(10);
    ModulatorState state;
    DelayLines lines(0);
    for (std::size_t k = 0; k < 100; ++k) {
      modulator.round(modes, lines, std::vector<double>{0.63, 0.37, 0.63, 0.37}, state, mode, owed, owed_sum);
      for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_NEAR(owed[i][0], whole.owed[5 * k + i], 1e-12);
        EXPECT_NEAR(owed_sum[i][0], whole.owed_sum[5 * k + i], 1e-12);
        lines.command(modes.pattern(mode[i]), timing), lines.advance(1);
      }
      state = {owed[5], owed_sum[5]};
    }
  }
}

TEST(PulseWidth, RandomProblemsGiveTheModesThatTheyAlwaysGave) {
  const auto digest_of = [](const char* valves) {
    const ModeSet modes = valve_modes(valves, ActuatorParameters());
    const SwitchTiming timing(modes, step_s);
    PulseWidth pulses;
    pulses.prepare(modes, timing, {std::vector<int>(8, 5)});
    std::mt19937_64 random(22);
    const auto share = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    std::uint64_t digest = 14695981039346656037u;
    const auto add = [&](std::int64_t v) { digest = (digest ^ static_cast<std::uint64_t>(v)) * 1099511628211u; };
    SwitchStates<double> owed{};
    DelayLines lines(modes.safe_pattern());
    std::vector<int> mode(40);
    std::vector<SwitchStates<double>> owes(40);
    for (int k = 0; k < 100; ++k) {
      std::vector<double> weights;
      for (int i = 0; i < 8; ++i) {
        std::vector<double> row;
        double sum = 0.0;
        for (int m = 0; m < modes.size(); ++m) sum += row.emplace_back(share() < 0.5 ? 0.0 : share());
        if (sum == 0.0) row[0] = sum = 1.0;
        for (const double r : row) weights.push_back(r / sum);
      }
      pulses.round(modes, lines, weights, owed, mode, owes);
      for (std::size_t j = 0; j < 40; ++j) {
        add(mode[j]);
        for (std::size_t c = 0; c < static_cast<std::size_t>(modes.switch_count()); ++c)
          add(std::llround(1e9 * owes[j][c]));
      }
      for (std::size_t i = 0; i < 5; ++i) lines.command(modes.pattern(mode[i]), timing), lines.advance(1);
      owed = owes[5];
    }
    return digest;
  };
  EXPECT_EQ(digest_of("three_way"), 10528206241471838186u);
  EXPECT_EQ(digest_of("two_way"), 5301182388855171223u);
  EXPECT_EQ(digest_of("seven_mode"), 16605767664200072596u);
}

}  // namespace
}  // namespace solenoid
