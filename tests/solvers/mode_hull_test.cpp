// The convex hull of a mode set as a product of simplices, found from the patterns.
#include "solvers/relaxed/mode_hull.hpp"

#include "core/systems/actuator/valves.hpp"

#include <bit>
#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// Modes of which the switches of each of `groups` take any of their own patterns, whatever the others do.
ModeSet product_of(std::size_t switches, const std::vector<std::vector<SwitchPattern>>& groups) {
  std::vector<SwitchPattern> patterns = {0};
  for (const auto& group : groups) {
    std::vector<SwitchPattern> more;
    for (const SwitchPattern p : patterns)
      for (const SwitchPattern own : group) more.push_back(p | own);
    patterns = more;
  }
  std::vector<Mode> modes;
  modes.reserve(patterns.size());
  for (const SwitchPattern p : patterns) modes.push_back({std::to_string(p), p});
  return {"product", std::vector<Switch>(switches), modes, {0.0}, std::vector(switches, std::vector{1.0})};
}

TEST(ModeHull, FindsTheChambersOfValveBanks) {
  for (const auto& [name, corners] :
       {std::pair{"two_way", 3}, {"dual_orifice", 5}, {"pcm_2", 7}, {"pcm_3", 15}, {"pcm_4", 31}}) {
    const ModeHull hull(valve_modes(name, {}));
    EXPECT_EQ(hull.weights(), 2 * (corners - 1)) << name;
    EXPECT_EQ(hull.sums.rows(), 2) << name;
  }
}

/// Three switches of which an even number is on: any two are independent, all three are not.
TEST(ModeHull, SeesWhatNoTwoSwitchesShow) {
  const std::vector<SwitchPattern> even = {0b000, 0b011, 0b101, 0b110};
  EXPECT_EQ(ModeHull(product_of(3, {even})).weights(), 3);
  const std::vector<SwitchPattern> free = {0b00000, 0b01000}, other = {0b00000, 0b10000};
  const ModeHull hull(product_of(5, {even, free, other}));
  EXPECT_EQ(hull.weights(), 3 + 1 + 1);
  EXPECT_EQ(hull.sums.rows(), 1);
}

/// Every mode's marginals give its pattern back, and products of marginals its weight.
TEST(ModeHull, IsExactAtTheModes) {
  for (const char* name : {"three_way", "two_way", "three_mode", "seven_mode", "dual_orifice", "pcm_3"}) {
    const ModeSet modes = valve_modes(name, {});
    const ModeHull hull(modes);
    Eigen::VectorXd v(hull.weights());
    std::vector<double> weights(static_cast<std::size_t>(modes.size())), back(weights.size());
    for (int m = 0; m < modes.size(); ++m) {
      std::fill(weights.begin(), weights.end(), 0.0);
      weights[static_cast<std::size_t>(m)] = 1.0;
      hull.marginals(weights, v.data());
      const Eigen::VectorXd c = hull.offset + hull.gain * v;
      for (int s = 0; s < modes.switch_count(); ++s)
        EXPECT_EQ(c[s], static_cast<double>((modes.pattern(m) >> s) & 1u)) << name << " mode " << m << " switch " << s;
      hull.mode_weights(v.data(), back);
      if (std::string(name) !=
          "seven_mode") {  // whose chambers depend on each other: its hull is larger than a product
        EXPECT_EQ(back, weights) << name << " mode " << m;
      }
    }
  }
}

}  // namespace
}  // namespace solenoid
