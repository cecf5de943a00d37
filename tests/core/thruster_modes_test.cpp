// The thrusters' mode sets, and the least-fuel closed form of a move along one axis.
#include "core/systems/thrusters/bang_off_bang.hpp"
#include "core/systems/thrusters/modes.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// What a name such as "+x -turn" asks for: signs of force along x, y and of torque.
std::array<int, 3> signs_of(const std::string& name) {
  std::array<int, 3> signs{};
  std::istringstream words(name == "coast" ? "" : name);
  for (std::string word; words >> word;) {
    const std::string what = word.substr(1);
    const std::size_t i = what == "x" ? 0 : what == "y" ? 1 : what == "turn" ? 2 : 3;
    signs.at(i) = word[0] == '+' ? 1 : word[0] == '-' ? -1 : 9;
  }
  return signs;
}

std::array<double, 3> push_of(const FreeFlyer& model, const ModeSet& modes, SwitchPattern pattern) {
  SwitchedOf<FreeFlyer> s;
  std::ranges::copy(modes.point(pattern), s.begin());
  const auto p = model.push<double>(s);
  const FreeFlyerParameters& q = model.parameters();  // in thrusters and levers
  return {p.forward * q.mass_kg / q.thrust_n, p.sideways * q.mass_kg / q.thrust_n,
          p.turn * q.inertia_kg_m2 / (q.thrust_n * q.lever_m)};
}

TEST(ThrusterModes, DoWhatTheirNamesSay) {
  const FreeFlyerParameters p;
  const FreeFlyer model(p);
  const int sizes[] = {3, 9, 7, 27};
  for (std::size_t n = 0; n < thruster_mode_sets().size(); ++n) {
    const std::string& name = thruster_mode_sets()[n];
    const ModeSet modes = thruster_modes(name, p);
    EXPECT_EQ(modes.name(), name);
    EXPECT_EQ(modes.size(), sizes[n]);
    EXPECT_EQ(modes.switched_size(), FreeFlyer::switched_size);
    EXPECT_EQ(modes.modes()[0].name, "coast");
    std::set<std::string> names;
    for (const Mode& mode : modes.modes()) {
      names.insert(mode.name);
      const std::array<int, 3> asked = signs_of(mode.name);
      const std::array<double, 3> push = push_of(model, modes, mode.pattern);
      const bool alone = name == "single" || (asked[0] != 0 && asked[1] != 0 && asked[2] != 0);
      for (std::size_t i = 0; i < 3; ++i) {
        const int thrusters = name == "single" || (alone && i < 2) ? 1 : 2;
        EXPECT_NEAR(push[i], asked[i] * thrusters, 1e-12) << name << ": " << mode.name << ", component " << i;
      }
      EXPECT_EQ(modes.find(mode.pattern), static_cast<int>(names.size()) - 1);  // no pattern twice
    }
    EXPECT_EQ(static_cast<int>(names.size()), modes.size());
  }
  EXPECT_THROW(thruster_modes("all", p), std::invalid_argument);
}

TEST(ThrusterModes, UseTheFewestThrustersForTheirPush) {
  const FreeFlyer model;
  for (const std::string& name : thruster_mode_sets()) {
    const ModeSet modes = thruster_modes(name, {});
    for (const Mode& mode : modes.modes())
      for (SwitchPattern other = 0; other < 256; ++other) {
        const std::array<double, 3> a = push_of(model, modes, mode.pattern), b = push_of(model, modes, other);
        if (std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]) > 1e-9) continue;
        EXPECT_LE(std::popcount(mode.pattern), std::popcount(other)) << name << ": " << mode.name;
      }
  }
}

TEST(ThrusterModes, TakeTheirTimesFromTheParameters) {
  FreeFlyerParameters p;
  p.rise_delay_s = 0.02;
  p.fall_delay_s = 0.03;
  for (const std::string& name : thruster_mode_sets()) {
    const SwitchTiming timing(thruster_modes(name, p), 0.01);
    EXPECT_EQ(timing.switches, 8);
    for (std::size_t c = 0; c < 8; ++c) {
      EXPECT_EQ(timing.rise[c], 2);
      EXPECT_EQ(timing.fall[c], 3);
      EXPECT_EQ(timing.dwell[c], 20);  // the greater of 0.1 s on and 0.2 s off
    }
  }
}

TEST(BangOffBang, ReachesItsTargetAtRestAndInTime) {
  const FreeFlyerParameters p;
  const FreeFlyer model(p);
  const double a = 2 * p.thrust_n / p.mass_kg;
  const ModeSet modes = thruster_modes("along_x", p);
  const auto held = [&](const StateOf<FreeFlyer>& x, SwitchPattern pattern, double duration) {
    SwitchedOf<FreeFlyer> s;
    std::ranges::copy(modes.point(pattern), s.begin());
    return model.step<double>(x, s, {}, duration);
  };
  std::mt19937_64 random(9);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (int trial = 0; trial < 100; ++trial) {
    const double d = uniform(0.001, 2), least = 2 * std::sqrt(d / a), t = least * uniform(1.0, 20.0);
    const BangOffBang way = bang_off_bang(d, a, t);
    EXPECT_NEAR(2 * way.burn_s + way.coast_s, t, 1e-12 * t);
    StateOf<FreeFlyer> x = held({}, modes.pattern(1), way.burn_s);
    EXPECT_NEAR(x[3], way.speed, 1e-14);
    x = held(x, modes.pattern(0), way.coast_s);
    x = held(x, modes.pattern(2), way.burn_s);
    EXPECT_NEAR(x[0], d, 1e-12);
    EXPECT_NEAR(x[3], 0.0, 1e-13);
    EXPECT_NEAR(way.fuel_kg(0.04), 0.04 * 2 * way.speed / a, 1e-14);
    // More time saves fuel; at the least time nothing is left to save.
    EXPECT_GT(bang_off_bang(d, a, t).burn_s, bang_off_bang(d, a, 1.01 * t).burn_s);
    EXPECT_NEAR(bang_off_bang(d, a, least * (1 + 1e-12)).coast_s, 0.0, 1e-5 * least);
    EXPECT_THROW(bang_off_bang(d, a, 0.999 * least), std::invalid_argument);
  }
  EXPECT_EQ(bang_off_bang(0.0, a, 1.0).burn_s, 0.0);
  EXPECT_THROW(bang_off_bang(1.0, 0.0, 100.0), std::invalid_argument);
  EXPECT_THROW(bang_off_bang(-1.0, a, 100.0), std::invalid_argument);
}

/// The distance from rest to rest of a control of blocks h, or a negative number where it does not end at rest.
double block_distance(const std::vector<int>& u, double a, double h) {
  double x = 0, v = 0;
  for (const int sign : u) {
    x += v * h + sign * a * h * h / 2;
    v += sign * a * h;
  }
  return std::abs(v) < 1e-12 ? x : -1.0;
}

TEST(BangOffBang, NoOtherWayIsCheaper) {
  // Every control of nine blocks, -1, 0 or +1: none from rest to rest burns less than the closed form of its distance.
  const double a = 0.1, h = 0.5, t = 9 * h;
  int ways = 0, as_cheap = 0;
  std::vector<int> u(9);
  for (int code = 0; code < 19683; ++code) {
    double burn = 0;
    for (int b = 0, rest = code; b < 9; ++b, rest /= 3) {
      u[static_cast<std::size_t>(b)] = rest % 3 - 1;
      burn += h * std::abs(rest % 3 - 1);
    }
    const double d = block_distance(u, a, h);
    if (d <= 0) continue;
    ++ways;
    const double least = 2 * bang_off_bang(d, a, t).burn_s;
    ASSERT_GE(burn, least - 1e-9);
    as_cheap += burn < least + 1e-9;
  }
  EXPECT_GT(ways, 1000);
  EXPECT_EQ(as_cheap, 4);  // bang-off-bang of one, two, three and four blocks
}

}  // namespace
}  // namespace solenoid
