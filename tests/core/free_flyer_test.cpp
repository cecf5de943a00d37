// The planar free-flyer: its step against its differential equations, closed forms and symmetries; derivatives; boxes.
#include "core/systems/thrusters/free_flyer.hpp"

#include "core/config/reader.hpp"
#include "core/mpc/mode_set.hpp"

#include <bit>
#include <cmath>
#include <numbers>
#include <random>

#include <Eigen/Core>
#include <gtest/gtest.h>
#include <unsupported/Eigen/AutoDiff>

namespace solenoid {
namespace {

static_assert(HybridModel<FreeFlyer> && HasConsumption<FreeFlyer> && HasStateScale<FreeFlyer> &&
              HasEnclosure<FreeFlyer>);

using FlyerState = StateOf<FreeFlyer>;
using Thrusters = SwitchedOf<FreeFlyer>;

double drawn(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution(low, high)(random);
}

FlyerState drawn_flyer(std::mt19937_64& random) {
  return {drawn(random, -2, 2),     drawn(random, -2, 2),     drawn(random, -9, 9),
          drawn(random, -0.5, 0.5), drawn(random, -0.5, 0.5), drawn(random, -1, 1)};
}

Thrusters drawn_thrusters(std::mt19937_64& random) {
  Thrusters s;
  for (double& on : s) on = drawn(random, 0, 1);
  return s;
}

Thrusters of_pattern(SwitchPattern pattern) {
  Thrusters s{};
  for (std::size_t c = 0; c < s.size(); ++c) s[c] = (pattern >> c) & 1u;
  return s;
}

/// A platform on a floor out of level, with a torque.
FreeFlyerParameters disturbed() {
  FreeFlyerParameters p;
  p.external_force_x_n = 1.5;
  p.external_force_y_n = -0.7;
  p.external_torque_nm = 0.2;
  return p;
}

FlyerState stepped(const FreeFlyer& model, FlyerState x, const Thrusters& s, double dt, int steps = 1) {
  for (int i = 0; i < steps; ++i) x = model.step<double>(x, s, {}, dt);
  return x;
}

/// The differential equations as one writes them on paper, thruster by thruster: place, direction of force, and the torque as
/// their cross product.
FlyerState flyer_rate(const FreeFlyerParameters& p, const FlyerState& x, const Thrusters& s) {
  const double l = p.lever_m;
  const double place[8][2] = {{l, 0}, {l, 0}, {0, l}, {0, l}, {-l, 0}, {-l, 0}, {0, -l}, {0, -l}};
  const double push[8][2] = {{0, 1}, {0, -1}, {-1, 0}, {1, 0}, {0, -1}, {0, 1}, {1, 0}, {-1, 0}};
  double fx = 0, fy = 0, torque = p.external_torque_nm;
  for (std::size_t c = 0; c < 8; ++c) {
    const double f = p.thrust_n * s[c];
    fx += f * push[c][0], fy += f * push[c][1];
    torque += f * (place[c][0] * push[c][1] - place[c][1] * push[c][0]);
  }
  const double sine = std::sin(x[FreeFlyer::angle]), cosine = std::cos(x[FreeFlyer::angle]);
  return {x[3],
          x[4],
          x[5],
          (cosine * fx - sine * fy + p.external_force_x_n) / p.mass_kg,
          (sine * fx + cosine * fy + p.external_force_y_n) / p.mass_kg,
          torque / p.inertia_kg_m2};
}

/// Their solution after `duration` by the classical Runge-Kutta method.
FlyerState flyer_after(const FreeFlyerParameters& p, FlyerState x, const Thrusters& s, double duration, int steps) {
  const double h = duration / steps;
  const auto moved = [](FlyerState y, const FlyerState& k, double by) {
    for (std::size_t i = 0; i < y.size(); ++i) y[i] += by * k[i];
    return y;
  };
  for (int n = 0; n < steps; ++n) {
    const FlyerState a = flyer_rate(p, x, s), b = flyer_rate(p, moved(x, a, h / 2), s);
    const FlyerState c = flyer_rate(p, moved(x, b, h / 2), s), d = flyer_rate(p, moved(x, c, h), s);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += h / 6 * (a[i] + 2 * (b[i] + c[i]) + d[i]);
  }
  return x;
}

double distance(const FlyerState& a, const FlyerState& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

TEST(SineCosine, IsThatOfTheStandardLibraryOverManyTurns) {
  std::mt19937_64 random(1);
  double worst = 0;
  for (int i = 0; i < 200'000; ++i) {
    const double angle = i % 2 ? drawn(random, -8, 8) : drawn(random, -1000, 1000);
    const SineCosine<double> sc = sine_cosine(angle);
    worst = std::max({worst, std::abs(sc.sine - std::sin(angle)), std::abs(sc.cosine - std::cos(angle))});
  }
  EXPECT_LT(worst, 2e-15);
  for (const double edge : {std::numbers::pi, -std::numbers::pi, 2 * std::numbers::pi, 0.0})
    EXPECT_NEAR(sine_cosine(edge).sine, std::sin(edge), 5e-16) << edge;
  EXPECT_EQ(sine_cosine(0.0).cosine, 1.0);
  EXPECT_TRUE(std::isnan(sine_cosine(std::numeric_limits<double>::infinity()).sine));
}

TEST(FreeFlyer, StepConvergesToItsDifferentialEquationsWithSecondOrder) {
  std::mt19937_64 random(2);
  const FreeFlyerParameters p = disturbed();
  const FreeFlyer model(p);
  for (int trial = 0; trial < 20; ++trial) {
    const FlyerState x = drawn_flyer(random);
    Thrusters s = of_pattern(0b01010101 & static_cast<SwitchPattern>(random()));
    s[3] = s[6] = 1.0;  // a force that turns with the platform
    const FlyerState exact = flyer_after(p, x, s, 1.0, 2000);
    const double coarse = distance(stepped(model, x, s, 0.1, 10), exact);
    const double fine = distance(stepped(model, x, s, 0.05, 20), exact);
    EXPECT_GT(coarse, 1e-8);
    EXPECT_NEAR(coarse / fine, 4.0, 0.2) << trial;
    EXPECT_LT(distance(stepped(model, x, s, 0.01, 100), exact), 1e-4 * distance(x, exact));
    EXPECT_NEAR(stepped(model, x, s, 0.1, 10)[FreeFlyer::angle], exact[FreeFlyer::angle], 1e-12);  // at any step
  }
}

TEST(FreeFlyer, OneStepIsOffByNoMoreThanItsHeaderSays) {
  std::mt19937_64 random(3);
  const FreeFlyerParameters p;
  const FreeFlyer model(p);
  double nearest_position = 0, nearest_velocity = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const FlyerState x = drawn_flyer(random);
    const Thrusters s = drawn_thrusters(random);
    const auto push = model.push<double>(s);
    const double dt = 0.02, force = std::hypot(push.forward, push.sideways), w = std::abs(x[FreeFlyer::rate]);
    const FlyerState got = stepped(model, x, s, dt), exact = flyer_after(p, x, s, dt, 50);
    const double velocity = force * (w * w + std::abs(push.turn)) * dt * dt * dt / 24;
    const double position = force * w * dt * dt * dt / 12 + velocity * dt / 2;  // with its next term
    const double off = std::hypot(got[0] - exact[0], got[1] - exact[1]);
    const double off_velocity = std::hypot(got[3] - exact[3], got[4] - exact[4]);
    EXPECT_LT(off, 1.02 * position + 1e-14);
    EXPECT_LT(off_velocity, 1.02 * velocity + 1e-14);
    nearest_position = std::max(nearest_position, off / position);
    nearest_velocity = std::max(nearest_velocity, off_velocity / velocity);
  }
  EXPECT_GT(nearest_position, 0.9);  // and the bounds are reached
  EXPECT_GT(nearest_velocity, 0.9);
}

TEST(FreeFlyer, WithoutRotationItIsADoubleIntegratorAtAnyStep) {
  const FreeFlyerParameters p;
  const FreeFlyer model(p);
  const double heading = 0.7, a = 2 * p.thrust_n / p.mass_kg, t = 2.0;
  const FlyerState from{0.3, -0.2, heading, 0.05, -0.1, 0.0};
  for (const int steps : {1, 7, 200}) {
    const FlyerState x = stepped(model, from, of_pattern(0b01001000), t / steps, steps);  // +x of the body
    EXPECT_NEAR(x[0], 0.3 + 0.05 * t + a * std::cos(heading) * t * t / 2, 1e-13);
    EXPECT_NEAR(x[1], -0.2 - 0.1 * t + a * std::sin(heading) * t * t / 2, 1e-13);
    EXPECT_NEAR(x[3], 0.05 + a * std::cos(heading) * t, 1e-13);
    EXPECT_NEAR(x[4], -0.1 + a * std::sin(heading) * t, 1e-13);
    EXPECT_EQ(x[2], heading);
    EXPECT_EQ(x[5], 0.0);
  }
}

TEST(FreeFlyer, AFullTurnUnderAPairOfThrustersFollowsItsClosedForm) {
  // From rest, two thrusters turn it by alpha t^2 / 2 and move it nowhere.
  const FreeFlyerParameters p;
  const FreeFlyer model(p);
  const double alpha = 2 * p.thrust_n * p.lever_m / p.inertia_kg_m2, t = std::sqrt(4 * std::numbers::pi / alpha);
  const FlyerState x = stepped(model, {}, of_pattern(0b00010001), t / 100, 100);
  EXPECT_NEAR(x[FreeFlyer::angle], 2 * std::numbers::pi, 1e-12);
  EXPECT_NEAR(x[FreeFlyer::rate], alpha * t, 1e-12);
  for (const std::size_t i : {0u, 1u, 3u, 4u}) EXPECT_EQ(x[i], 0.0);
}

TEST(FreeFlyer, MomentumChangesByTheThrustersImpulseAlone) {
  std::mt19937_64 random(4);
  const FreeFlyerParameters p;
  const FreeFlyer model(p);
  for (int trial = 0; trial < 200; ++trial) {
    const FlyerState x = drawn_flyer(random);
    const double dt = drawn(random, 0.001, 0.1);
    const Thrusters s = drawn_thrusters(random);
    const FlyerState next = stepped(model, x, s, dt);
    // The impulse has the size of the body's force, whatever the angle, and the torque that of the lever.
    const double impulse = p.mass_kg * std::hypot(next[3] - x[3], next[4] - x[4]);
    EXPECT_NEAR(impulse, p.thrust_n * dt * std::hypot(s[3] + s[6] - s[2] - s[7], s[0] + s[5] - s[1] - s[4]), 1e-12);
    EXPECT_NEAR(p.inertia_kg_m2 * (next[5] - x[5]),
                p.thrust_n * p.lever_m * dt * (s[0] - s[1] + s[2] - s[3] + s[4] - s[5] + s[6] - s[7]), 1e-12);
    // Thrusters back to back cancel: all eight are as good as none.
    EXPECT_EQ(stepped(model, x, of_pattern(0xff), dt), stepped(model, x, of_pattern(0), dt));
    // Without thrust both momenta are kept, to the last bit.
    const FlyerState coasted = stepped(model, x, of_pattern(0), dt);
    for (const std::size_t i : {3u, 4u, 5u}) EXPECT_EQ(coasted[i], x[i]);
  }
}

/// The floor's axes turned by phi and moved.
FlyerState seen_from(const FlyerState& x, double phi, double speed, double t) {
  const double c = std::cos(phi), s = std::sin(phi);
  return {c * x[0] - s * x[1] + speed * t, s * x[0] + c * x[1], x[2] + phi,
          c * x[3] - s * x[4] + speed,     s * x[3] + c * x[4], x[5]};
}

TEST(FreeFlyer, TurningAndMovingTheAxesTurnsAndMovesTheMotion) {
  std::mt19937_64 random(5);
  const FreeFlyer model;
  for (int trial = 0; trial < 200; ++trial) {
    const FlyerState x = drawn_flyer(random);
    const Thrusters s = drawn_thrusters(random);
    const double phi = drawn(random, -7, 7), speed = drawn(random, -1, 1), dt = 0.1;
    EXPECT_LT(distance(stepped(model, seen_from(x, phi, speed, 0), s, dt),
                       seen_from(stepped(model, x, s, dt), phi, speed, dt)),
              1e-14);
  }
}

TEST(FreeFlyer, ConsumptionCountsOpenThrusters) {
  const FreeFlyerParameters p;
  const FreeFlyer model(p);
  for (SwitchPattern pattern = 0; pattern < 256; ++pattern)
    EXPECT_NEAR(model.consumption<double>({}, of_pattern(pattern)), p.flow_kg_per_s * std::popcount(pattern), 1e-16);
}

TEST(FreeFlyer, DerivativesAgreeWithFiniteDifferences) {
  using Derivatives = Eigen::Matrix<double, 14, 1>;
  using AutoDiff = Eigen::AutoDiffScalar<Derivatives>;
  std::mt19937_64 random(6);
  const FreeFlyer model(disturbed());
  const double dt = 0.1;
  for (int trial = 0; trial < 50; ++trial) {
    const FlyerState x = drawn_flyer(random);
    const Thrusters s = drawn_thrusters(random);
    Vector<AutoDiff, 6> xs;
    Vector<AutoDiff, 8> ss;
    for (int i = 0; i < 6; ++i) xs[static_cast<std::size_t>(i)] = AutoDiff(x[static_cast<std::size_t>(i)], 14, i);
    for (int i = 0; i < 8; ++i) ss[static_cast<std::size_t>(i)] = AutoDiff(s[static_cast<std::size_t>(i)], 14, 6 + i);
    const Vector<AutoDiff, 6> next = model.step<AutoDiff>(xs, ss, {}, dt);
    EXPECT_EQ(next[0].value(), stepped(model, x, s, dt)[0]);
    for (std::size_t i = 0; i < 14; ++i) {
      const double h = 1e-5;
      FlyerState up = x, down = x;
      Thrusters more = s, less = s;
      (i < 6 ? up[i] : more[i - 6]) += h;
      (i < 6 ? down[i] : less[i - 6]) -= h;
      const FlyerState a = stepped(model, up, more, dt), b = stepped(model, down, less, dt);
      for (std::size_t k = 0; k < 6; ++k)
        EXPECT_NEAR(next[k].derivatives()[static_cast<Eigen::Index>(i)], (a[k] - b[k]) / (2 * h), 1e-8);
    }
  }
}

/// A point of a box: one of its corners every other time.
template <std::size_t n>
Vector<double, n> point_of(std::mt19937_64& random, const Vector<double, n>& low, const Vector<double, n>& high) {
  Vector<double, n> x;
  const bool corner = random() % 2;
  for (std::size_t i = 0; i < n; ++i)
    x[i] = corner ? (random() % 2 ? low[i] : high[i]) : drawn(random, low[i], std::nextafter(high[i], 1e9));
  return x;
}

TEST(FreeFlyerEnclosure, NoWayLeavesItsBoxes) {
  std::mt19937_64 random(7);
  const FreeFlyer model(disturbed());
  for (int trial = 0; trial < 400; ++trial) {
    FlyerState low = drawn_flyer(random), high = low;
    const double widths[] = {0.0, 0.01, 0.3, 3.0}, width = widths[trial % 4];
    for (double& h : high) h += drawn(random, 0, width);
    Thrusters least = drawn_thrusters(random), most = least;
    for (std::size_t c = 0; c < 8; ++c) most[c] = trial % 3 ? 1.0 : drawn(random, least[c], 1.0);
    const double dt = trial % 2 ? 0.01 : 0.1;
    std::vector<FlyerState> ways(20);
    for (FlyerState& way : ways) way = point_of(random, low, high);
    for (int j = 0; j < 30; ++j) {
      model.enclose_step<double>(low, high, least, most, {}, {}, dt);
      for (FlyerState& way : ways) {
        way = stepped(model, way, point_of(random, least, most), dt);
        for (std::size_t i = 0; i < 6; ++i) {
          const double rounding = 1e-12 * (std::abs(low[i]) + std::abs(high[i]));
          ASSERT_GE(way[i], low[i] - rounding) << "state " << i << " step " << j << " trial " << trial;
          ASSERT_LE(way[i], high[i] + rounding) << "state " << i << " step " << j << " trial " << trial;
        }
      }
    }
  }
}

TEST(FreeFlyerEnclosure, IsTight) {
  std::mt19937_64 random(8);
  const FreeFlyer model(disturbed());
  for (int trial = 0; trial < 50; ++trial) {
    // Of a point under known thrusters it is the point's image.
    const FlyerState x = drawn_flyer(random);
    const Thrusters s = drawn_thrusters(random);
    FlyerState low = x, high = x;
    model.enclose_step<double>(low, high, s, s, {}, {}, 0.1);
    EXPECT_LT(distance(low, high), 1e-14);
    EXPECT_LT(distance(low, stepped(model, x, s, 0.1)), 1e-14);
  }
  // Of a point at angle 0 it is reached: by the pair along each axis, and by all thrusters that turn one way.
  const Thrusters none{}, all = of_pattern(0xff);
  FlyerState low{}, high{};
  const FreeFlyer calm;
  calm.enclose_step<double>(low, high, none, all, {}, {}, 0.01);
  EXPECT_NEAR(high[3], stepped(calm, {}, of_pattern(0b01001000), 0.01)[3], 1e-6);
  EXPECT_NEAR(low[4], stepped(calm, {}, of_pattern(0b00010010), 0.01)[4], 1e-6);
  EXPECT_EQ(high[5], stepped(calm, {}, of_pattern(0b01010101), 0.01)[5]);
  // Half a second later it is still within a fifth of what a pair reaches.
  for (int j = 1; j < 50; ++j) calm.enclose_step<double>(low, high, none, all, {}, {}, 0.01);
  const double reached = stepped(calm, {}, of_pattern(0b01001000), 0.01, 50)[0];
  EXPECT_GT(high[0], reached);
  EXPECT_LT(high[0], 1.2 * reached);
}

TEST(FreeFlyerParameters, OutOfRangeAreRefusedByName) {
  const auto refused = [](double FreeFlyerParameters::*field, double value, const std::string& name) {
    FreeFlyerParameters p;
    p.*field = value;
    try {
      FreeFlyer model(p);
    } catch (const ConfigError& error) {
      return std::string(error.what()).find(name) != std::string::npos;
    }
    return false;
  };
  using P = FreeFlyerParameters;
  EXPECT_TRUE(refused(&P::mass_kg, 0.0, "mass_kg"));
  EXPECT_TRUE(refused(&P::inertia_kg_m2, -1.0, "inertia_kg_m2"));
  EXPECT_TRUE(refused(&P::thrust_n, std::nan(""), "thrust_n"));
  EXPECT_TRUE(refused(&P::least_off_s, -0.1, "least_off_s"));
  EXPECT_TRUE(refused(&P::external_torque_nm, std::numeric_limits<double>::infinity(), "external_torque_nm"));
  EXPECT_FALSE(refused(&P::flow_kg_per_s, 0.0, "flow_kg_per_s"));
}

}  // namespace
}  // namespace solenoid
