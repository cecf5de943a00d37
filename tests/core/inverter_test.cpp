// The inverter's load by what is known of it: fine integration, phasors, the vectors of its modes, enclosed points.
#include "core/systems/inverter/inverter.hpp"

#include "core/systems/inverter/modes.hpp"

#include <bit>
#include <complex>
#include <map>
#include <random>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unsupported/Eigen/AutoDiff>

namespace solenoid {
namespace {

static_assert(HybridModel<InverterLoad> && HasEnclosure<InverterLoad> && HasStateScale<InverterLoad>);
static_assert(!HasConsumption<InverterLoad> && !HasFeedback<InverterLoad> && !HasSmoothStep<InverterLoad>);

using InverterState = StateOf<InverterLoad>;
using PhaseLevels = SwitchedOf<InverterLoad>;

/// Reproducible loads, from small to large time constants.
InverterParameters drawn_load(std::mt19937_64& random) {
  const auto between = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  InverterParameters p;
  p.resistance_ohm = std::exp(between(-4.0, 3.0));
  p.inductance_h = std::exp(between(-8.0, -4.0));
  p.emf_frequency_hz = between(-100.0, 100.0);
  return p;
}

InverterState drawn_state(std::mt19937_64& random) {
  const auto between = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  return {between(-600, 600), between(-600, 600), between(-2500, 2500), between(-2500, 2500)};
}

PhaseLevels drawn_levels(std::mt19937_64& random) {
  const auto level = [&] { return std::uniform_real_distribution(-1.0, 1.0)(random); };
  return {level(), level(), level()};
}

/// The differential equations as they stand, phase voltages against the load's star point.
InverterState inverter_rate(const InverterParameters& p, const InverterState& x, const PhaseLevels& u) {
  const double star = (u[0] + u[1] + u[2]) / 3;
  const double va = p.dc_link_v / 2 * (u[0] - star), vb = p.dc_link_v / 2 * (u[1] - star),
               vc = p.dc_link_v / 2 * (u[2] - star);
  const double w = 2 * std::numbers::pi * p.emf_frequency_hz;
  return {(va - p.resistance_ohm * x[0] - x[2]) / p.inductance_h,
          ((vb - vc) / std::sqrt(3.0) - p.resistance_ohm * x[1] - x[3]) / p.inductance_h, -w * x[3], w * x[2]};
}

InverterState runge_kutta_inverter(const InverterParameters& p, InverterState x, const PhaseLevels& u, double dt,
                                   int steps) {
  const auto shifted = [](const InverterState& a, const InverterState& d, double h) {
    return InverterState{a[0] + h * d[0], a[1] + h * d[1], a[2] + h * d[2], a[3] + h * d[3]};
  };
  const double h = dt / steps;
  for (int i = 0; i < steps; ++i) {
    const auto a = inverter_rate(p, x, u), b = inverter_rate(p, shifted(x, a, h / 2), u),
               c = inverter_rate(p, shifted(x, b, h / 2), u), d = inverter_rate(p, shifted(x, c, h), u);
    for (std::size_t k = 0; k < 4; ++k) x[k] += h / 6 * (a[k] + 2 * (b[k] + c[k]) + d[k]);
  }
  return x;
}

TEST(Inverter, StepIsTheSolutionUnderHeldLevels) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const InverterParameters p = drawn_load(random);
    const InverterLoad load(p);
    const InverterState x = drawn_state(random);
    const PhaseLevels u = drawn_levels(random);
    for (const double dt : {p.sampling_s, 4e-4}) {  // its own sampling time, and another
      const InverterState stepped = load.step<double>(x, u, {}, dt);
      const InverterState fine = runge_kutta_inverter(p, x, u, dt, 4000);
      for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(stepped[k], fine[k], 1e-7) << trial << " state " << k;
    }
    // Ten steps are one of ten times the length.
    InverterState ten = x;
    for (int i = 0; i < 10; ++i) ten = load.step<double>(ten, u, {}, p.sampling_s);
    const InverterState one = load.step<double>(x, u, {}, 10 * p.sampling_s);
    for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(ten[k], one[k], 1e-9);
  }
}

TEST(Inverter, SettlesOnThePhasorOfItsForce) {
  InverterParameters p;
  p.resistance_ohm = 2.0;  // settles within the test
  const InverterLoad load(p);
  const auto [e_a, e_b] = load.emf(0.3);
  InverterState x = {100.0, -50.0, e_a, e_b};
  const ModeSet modes = inverter_modes("three_level");
  const auto zero = modes.point(modes.pattern(0));
  for (int i = 0; i < 4000; ++i) x = load.step<double>(x, {zero[0], zero[1], zero[2]}, {}, p.sampling_s);
  // With v = 0: i = -e / (R + j w L), and the force has turned five times.
  const std::complex<double> impedance(p.resistance_ohm, 2 * std::numbers::pi * 50 * p.inductance_h);
  const std::complex<double> current = -std::polar(p.emf_amplitude_v, 0.3) / impedance;
  EXPECT_NEAR(x[2], e_a, 1e-8);
  EXPECT_NEAR(x[3], e_b, 1e-8);
  EXPECT_NEAR(x[0], current.real(), 1e-8);
  EXPECT_NEAR(x[1], current.imag(), 1e-8);
}

TEST(Inverter, RatedForceIsWhatTheRatedPointAsksFor) {
  const InverterParameters p;  // 3.3 kV, 356 A, power factor 0.85
  const std::complex<double> current = std::polar(std::numbers::sqrt2 * 356, -std::acos(0.85));
  const std::complex<double> impedance(p.resistance_ohm, 2 * std::numbers::pi * 50 * p.inductance_h);
  EXPECT_NEAR(std::abs(3300 * std::sqrt(2.0 / 3) - impedance * current), p.emf_amplitude_v, 1.0);
  EXPECT_NEAR(p.rated_current_a, std::abs(current), 0.1);
  EXPECT_NEAR(p.resistance_ohm, 57.61e-3 + 48.89e-3 * std::pow(40.01 / (40.01 + 1.881), 2), 1e-4);
  EXPECT_NEAR(p.inductance_h, 2.544e-3 + 40.01e-3 - 40.01e-3 * 40.01 / (40.01 + 1.881), 1e-5);
}

TEST(Clarke, KeepsAmplitudesAndForgetsTheMean) {
  for (double angle = 0.0; angle < 6.3; angle += 0.1) {
    const double third = 2 * std::numbers::pi / 3;
    const Vector<double, 3> abc = {7 * std::cos(angle), 7 * std::cos(angle - third), 7 * std::cos(angle + third)};
    const auto v = clarke<double>(abc);
    EXPECT_NEAR(v[0], 7 * std::cos(angle), 1e-13);
    EXPECT_NEAR(v[1], 7 * std::sin(angle), 1e-13);
    const auto shifted = clarke<double>({abc[0] + 3, abc[1] + 3, abc[2] + 3});
    const auto back = inverse_clarke<double>(v);
    for (std::size_t k = 0; k < 2; ++k) EXPECT_NEAR(shifted[k], v[k], 1e-13);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(back[k], abc[k], 1e-13);
  }
}

/// The voltage vectors of a mode set per half the dc-link voltage, by how many modes have each.
std::map<std::pair<long, long>, int> voltage_vectors(const ModeSet& modes) {
  std::map<std::pair<long, long>, int> vectors;
  for (const Mode& mode : modes.modes()) {
    const auto level = modes.point(mode.pattern);
    const auto v = clarke<double>({level[0], level[1], level[2]});
    ++vectors[{std::lround(3e6 * v[0]), std::lround(3e6 * v[1])}];
  }
  return vectors;
}

TEST(InverterModes, OfThreeLevelsHaveNineteenVectors) {
  const ModeSet modes = inverter_modes("three_level");
  ASSERT_EQ(modes.size(), 27);
  const auto vectors = voltage_vectors(modes);
  EXPECT_EQ(vectors.size(), 19u);
  EXPECT_EQ(vectors.at({0, 0}), 3);
  std::map<int, int> with;  // how many vectors have so many modes: 12 long and middle ones, 6 short, zero
  for (const auto& [vector, count] : vectors) ++with[count];
  EXPECT_THAT(with, testing::ElementsAre(testing::Pair(1, 12), testing::Pair(2, 6), testing::Pair(3, 1)));
  const ModeSet two = inverter_modes("two_level");
  ASSERT_EQ(two.size(), 8);
  EXPECT_EQ(voltage_vectors(two).size(), 7u);
}

TEST(InverterModes, AreNamedByTheirLevels) {
  for (const std::string& configuration : inverter_configurations()) {
    const ModeSet modes = inverter_modes(configuration);
    EXPECT_EQ(modes.name(), configuration);
    for (const Mode& mode : modes.modes()) {
      const auto level = modes.point(mode.pattern);
      ASSERT_EQ(mode.name.size(), 3u);
      for (std::size_t phase = 0; phase < 3; ++phase)
        EXPECT_EQ(level[phase], mode.name[phase] == '+' ? 1 : mode.name[phase] == '-' ? -1 : 0) << mode.name;
    }
  }
  EXPECT_EQ(inverter_modes("three_level").modes()[0].name, "000");
  EXPECT_THROW(inverter_modes("five_level"), std::invalid_argument);
}

TEST(InverterModes, SwitchChangesAreTheNormOfTheStepInLevelsOfAtMostOne) {
  const ModeSet modes = inverter_modes("three_level");
  const SwitchTiming timing(modes, InverterParameters().sampling_s);
  for (const Mode& from : modes.modes())
    for (const Mode& to : modes.modes()) {
      double largest = 0, sum = 0, squares = 0;
      for (std::size_t phase = 0; phase < 3; ++phase) {
        const double change = modes.point(to.pattern)[phase] - modes.point(from.pattern)[phase];
        largest = std::max(largest, std::abs(change));
        sum += std::abs(change);
        squares += change * change;
      }
      EXPECT_EQ(DelayLines(from.pattern).may_command(to.pattern, timing), largest <= 1) << from.name << to.name;
      EXPECT_EQ(std::popcount(from.pattern ^ to.pattern), sum);
      if (largest <= 1) {
        EXPECT_EQ(sum, squares);
      }
    }
  for (const Mode& from : modes.modes())
    EXPECT_TRUE(DelayLines(from.pattern).may_command(modes.pattern(0), timing)) << from.name;
}

TEST(InverterModes, TakeTheirDelayFromTheParameters) {
  InverterParameters p;
  p.switching_delay_s = 50e-6;
  const SwitchTiming timing(inverter_modes("three_level", p), p.sampling_s);
  for (std::size_t c = 0; c < 6; ++c) {
    EXPECT_EQ(timing.rise[c], 2);
    EXPECT_EQ(timing.fall[c], 2);
  }
}

TEST(Inverter, EnclosureHoldsEveryPointAndIsReached) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution unit(0.0, 1.0);
  for (int trial = 0; trial < 200; ++trial) {
    const InverterParameters p = drawn_load(random);
    const InverterLoad load(p);
    const double dt = trial % 2 ? p.sampling_s : 0.004;  // the force turns by up to 144 degrees: every sign
    InverterState low = drawn_state(random), high = low;
    for (double& h : high) h += trial % 3 ? 100 * unit(random) : 0.0;
    PhaseLevels u_low = drawn_levels(random), u_high;
    for (std::size_t k = 0; k < 3; ++k) u_high[k] = std::min(1.0, u_low[k] + unit(random));
    InverterState box_low = low, box_high = high;
    load.enclose_step<double>(box_low, box_high, u_low, u_high, {}, {}, dt);
    InverterState least, most;
    least.fill(INFINITY), most.fill(-INFINITY);
    for (int corner = 0; corner < 128 + 50; ++corner) {  // all corners, then points inside
      const auto pick = [&](double from, double to, int bit) {
        return corner < 128 ? ((corner >> bit) & 1 ? to : from) : from + unit(random) * (to - from);
      };
      InverterState x;
      PhaseLevels u;
      for (std::size_t k = 0; k < 4; ++k) x[k] = pick(low[k], high[k], static_cast<int>(k));
      for (std::size_t k = 0; k < 3; ++k) u[k] = pick(u_low[k], u_high[k], static_cast<int>(k) + 4);
      const InverterState next = load.step<double>(x, u, {}, dt);
      for (std::size_t k = 0; k < 4; ++k) {
        least[k] = std::min(least[k], next[k]);
        most[k] = std::max(most[k], next[k]);
      }
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const double rounding = 1e-12 * (std::abs(least[k]) + std::abs(most[k]) + 1e3);
      EXPECT_NEAR(box_low[k], least[k], rounding) << trial << " state " << k;
      EXPECT_NEAR(box_high[k], most[k], rounding) << trial << " state " << k;
    }
  }
}

TEST(Inverter, DualNumbersCarryTheDerivativesOfStep) {
  using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, 7, 1>>;
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const InverterLoad load(drawn_load(random));
    const double dt = load.parameters().sampling_s;
    const InverterState x = drawn_state(random);
    const PhaseLevels u = drawn_levels(random);
    Vector<Dual, 4> dual_x;
    Vector<Dual, 3> dual_u;
    for (int k = 0; k < 4; ++k) dual_x[static_cast<std::size_t>(k)] = Dual(x[static_cast<std::size_t>(k)], 7, k);
    for (int k = 0; k < 3; ++k) dual_u[static_cast<std::size_t>(k)] = Dual(u[static_cast<std::size_t>(k)], 7, 4 + k);
    const Vector<Dual, 4> next = load.step<Dual>(dual_x, dual_u, {}, dt);
    for (std::size_t i = 0; i < 7; ++i) {
      const double h = i < 4 ? 1.0 : 1e-3;  // linear: any difference will do
      InverterState x_up = x, x_down = x;
      PhaseLevels u_up = u, u_down = u;
      (i < 4 ? x_up[i] : u_up[i - 4]) += h;
      (i < 4 ? x_down[i] : u_down[i - 4]) -= h;
      const auto up = load.step<double>(x_up, u_up, {}, dt), down = load.step<double>(x_down, u_down, {}, dt);
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_NEAR(next[k].derivatives()[static_cast<Eigen::Index>(i)], (up[k] - down[k]) / (2 * h), 1e-8) << k << i;
        EXPECT_EQ(next[k].value(), load.step<double>(x, u, {}, dt)[k]);
      }
    }
  }
}

TEST(Inverter, RefusesWhatIsNotPositive) {
  for (double InverterParameters::*value : {&InverterParameters::dc_link_v, &InverterParameters::resistance_ohm,
                                            &InverterParameters::inductance_h, &InverterParameters::sampling_s})
    for (const double wrong : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
      InverterParameters p;
      p.*value = wrong;
      EXPECT_THROW(InverterLoad{p}, std::invalid_argument) << wrong;
    }
}

}  // namespace
}  // namespace solenoid
