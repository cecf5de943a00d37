// What is left of an identified force: hats that are zero outside the data, their bounds, and the file they are read from.
#include "core/config/reader.hpp"
#include "core/systems/actuator/residual_actuator.hpp"

#include <cmath>
#include <random>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::vector<double> hat_knots = {-0.3, -0.1, -0.002, 0.0, 0.004, 0.2, 0.25};
const std::vector<double> hat_values = {0.0, 0.4, 1.5, 0.0, -1.2, -0.3, 0.0};

ForceResidual read_text(const std::string& text) {
  TableReader table = TableReader::from_text(text, "mine.toml");
  return read_force_residual(table);
}
std::string why_not(const std::string& text) {
  try {
    read_text(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(HatSum, InterpolatesBetweenItsKnots) {
  const HatSum hats(hat_knots, hat_values);
  for (std::size_t i = 0; i + 1 < hat_knots.size(); ++i)
    for (const double share : {0.0, 0.25, 0.9}) {
      const double x = hat_knots[i] + share * (hat_knots[i + 1] - hat_knots[i]);
      EXPECT_NEAR(hats.at(x), hat_values[i] + share * (hat_values[i + 1] - hat_values[i]), 1e-12) << x;
    }
}

TEST(HatSum, IsZeroOutsideAndNoNumberChangesNothing) {
  const HatSum hats(hat_knots, hat_values);
  for (const double x : {-0.3, -0.31, -5.0, 0.25, 0.2500001, 1e9, std::nan("")}) {
    EXPECT_EQ(hats.at(x), 0.0) << x;
    EXPECT_FALSE(hats.covers(x)) << x;
  }
  EXPECT_EQ(HatSum().at(0.1), 0.0);
  EXPECT_TRUE(HatSum().empty());
}

TEST(HatSum, RangeHoldsEveryValueAndIsTaken) {
  const HatSum hats(hat_knots, hat_values);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> anywhere(-0.4, 0.35);
  for (int trial = 0; trial < 200; ++trial) {
    double low = anywhere(random), high = anywhere(random);
    if (low > high) std::swap(low, high);
    const auto range = hats.range(low, high);
    double least = 1e9, most = -1e9;
    for (int i = 0; i <= 4000; ++i) {
      const double value = hats.at(low + (high - low) * i / 4000);
      least = std::min(least, value), most = std::max(most, value);
    }
    const double steepest = 750.0, grid = steepest * (high - low) / 4000;  // N between two points of the grid
    EXPECT_LE(range[0], least + 1e-12);
    EXPECT_GE(range[1], most - 1e-12);
    EXPECT_GE(range[0], least - grid);
    EXPECT_LE(range[1], most + grid);
  }
}

TEST(HatSum, RefusesWhatIsNoSuchFunction) {
  const auto make = [](std::vector<double> knots, std::vector<double> values) { return HatSum(knots, values); };
  EXPECT_THROW(make({0.0, 1.0}, {0.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(make({0.0, 1.0, 1.0}, {0.0, 1.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(make({0.0, 1.0, 2.0}, {0.0, 1.0, 0.5}), std::invalid_argument);
  EXPECT_THROW(make({0.0, 1.0, 2.0}, {0.0, 1.0}), std::invalid_argument);
  EXPECT_THROW(make({0.0, std::nan(""), 2.0}, {0.0, 1.0, 0.0}), std::invalid_argument);
  // Between these a slope is no number, or loses the values behind it to rounding.
  EXPECT_THROW(make({-0.05, 0.0, 1e-320, 0.2}, {0.0, 0.0, 5.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(make({-0.1, 0.0, 1e-14, 0.1, 0.2}, {0.0, 0.0, 5.0, 2.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(make(std::vector<double>(HatSum::most_knots + 1), std::vector<double>(HatSum::most_knots + 1)),
               std::invalid_argument);
}

TEST(ForceResidual, IsReadFromATable) {
  const ForceResidual found = read_text(
      "velocity = { knots_m_s = [-0.1, -0.01, 0.0, 0.01, 0.1], force_n = [0, 0.5, 0, -0.5, 0] }\n"
      "position = { knots_m = [0.0, 0.05, 0.1], force_n = [0, 0.2, 0] }\n[identified]\nlogs = \"a.mcap\"\n");
  EXPECT_NEAR(found.force(0.05, 0.01), -0.3, 1e-12);
  EXPECT_NEAR(found.force(0.05, 0.2), 0.2, 1e-12);
  EXPECT_EQ(found.force(0.2, 0.2), 0.0);
  EXPECT_TRUE(found.covers(0.05, 0.0));
  EXPECT_FALSE(found.covers(0.05, 0.2));
  EXPECT_FALSE(found.covers(0.2, 0.05));
  EXPECT_TRUE(read_text("").empty());
}

TEST(ForceResidual, RefusesWithKeyAndWhatIsAllowed) {
  EXPECT_THAT(why_not("velocity = { knots_m_s = [-0.1, 0.0, 0.1], force_n = [0, 0.5, 0] }"),
              AllOf(HasSubstr("velocity"), HasSubstr("at rest"), HasSubstr("allowed")));
  EXPECT_THAT(why_not("position = { knots_m = [0.0, 0.1, 0.05], force_n = [0, 0.5, 0] }"),
              AllOf(HasSubstr("knots_m"), HasSubstr("increasing")));
  EXPECT_THAT(why_not("position = { knots_m = [0.0, 0.1, 0.2], force_n = [0, 500, 0] }"), HasSubstr("force_n"));
  EXPECT_THAT(why_not("speed = 1"), HasSubstr("speed"));
}

TEST(ResidualActuator, WithoutAResidualStepsAsThePrestabilisedActuator) {
  const ActuatorParameters parameters;
  PrestabilisedActuator usual(parameters, {});
  ResidualActuator same(parameters, {}, {});
  usual.set_load(0.13, -0.7);
  same.set_load(0.13, -0.7);
  std::mt19937_64 random(5);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (int trial = 0; trial < 500; ++trial) {
    const ActuatorState x = {uniform(-0.006, 0.12), trial % 3 ? uniform(-0.4, 0.4) : 0.0, uniform(9e4, 2.6e5),
                             uniform(9e4, 2.6e5)};
    const Vector<double, 4> opening = {uniform(0, 1), uniform(0, 1), uniform(0, 1), uniform(0, 1)};
    const Vector<double, 1> motor = {uniform(-9, 9)};
    EXPECT_EQ(usual.step(x, opening, motor, 1e-3), same.step(x, opening, motor, 1e-3));
    EXPECT_EQ(usual.smooth_step(x, opening, motor, 1e-3), same.smooth_step(x, opening, motor, 1e-3));
  }
}

TEST(ResidualActuator, TheForceMovesTheSlideAsAnExternalOneDoes) {
  ForceResidual residual;
  residual.velocity = HatSum(hat_knots, hat_values);
  ResidualActuator with({}, {}, residual);
  PneumaticActuator pushed;
  std::mt19937_64 random(6);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (int trial = 0; trial < 500; ++trial) {
    const ActuatorState x = {uniform(0.0, 0.11), uniform(-0.4, 0.4), uniform(9e4, 2.6e5), uniform(9e4, 2.6e5)};
    with.set_load(0.1, 0.25);
    pushed.set_load(0.1, 0.25 + residual.force(x[position], x[velocity]));
    const auto a = with.step(x, {0, 1, 0.5, 0}, {2.0}, 1e-3), b = pushed.step(x, {0, 1, 0.5, 0}, {2.0}, 1e-3);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(a[i], b[i], 1e-12 * (1.0 + std::abs(b[i])));
    const auto c = with.smooth_step(x, {0, 1, 0.5, 0}, {2.0}, 1e-3),
               d = pushed.smooth_step(x, {0, 1, 0.5, 0}, {2.0}, 1e-3);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(c[i], d[i], 1e-12 * (1.0 + std::abs(d[i])));
  }
}

}  // namespace
}  // namespace solenoid
