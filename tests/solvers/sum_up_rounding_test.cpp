#include "solvers/rounding/sum_up_rounding.hpp"

#include "tests/support/random_weights.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

std::vector<int> rounded(const ModeWeights& weights) {
  std::vector<int> modes;
  EXPECT_EQ(sum_up_rounding(weights, modes).status, Status::feasible);
  return modes;
}

/// The weights against which sum-up rounding does worst: each row spread evenly over the modes not chosen yet.
ModeWeights worst_case(int modes) {
  ModeWeights weights(modes, std::vector<double>(static_cast<std::size_t>(modes - 1), 1.0));
  for (int k = 0; k + 1 < modes; ++k)
    for (int m = k; m < modes; ++m)
      weights.at(static_cast<std::size_t>(k), static_cast<std::size_t>(m)) = 1.0 / (modes - k);
  return weights;
}

TEST(SumUpRounding, ByHand) {
  ModeWeights weights(2, {1.0, 1.0, 1.0, 1.0});
  for (std::size_t k = 0; k < 4; ++k) weights.at(k, 0) = 0.3, weights.at(k, 1) = 0.7;
  // owed to mode 0 before each choice: 0.3, 0.6, -0.1, 0.2; to mode 1: 0.7, 0.4, 1.1, 0.8
  EXPECT_EQ(rounded(weights), (std::vector<int>{1, 0, 1, 1}));
  EXPECT_NEAR(integral_gap(weights, std::vector<int>{1, 0, 1, 1}), 0.4, 1e-12);
}

TEST(SumUpRounding, TiesGoToTheLowestModeNumber) {
  ModeWeights weights(4, {1.0, 1.0, 1.0, 1.0});
  for (double& a : weights.weight) a = 0.25;
  EXPECT_EQ(rounded(weights), (std::vector<int>{0, 1, 2, 3}));
}

TEST(SumUpRounding, IntegerWeightsAreTheirOwnRounding) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 50; ++trial) {
    ModeWeights weights = test::random_weights(random, 5, 20, trial % 2);
    std::vector<int> truth;
    std::fill(weights.weight.begin(), weights.weight.end(), 0.0);
    for (std::size_t k = 0; k < 20; ++k) {
      truth.push_back(static_cast<int>(random() % 5));
      weights.at(k, static_cast<std::size_t>(truth.back())) = 1.0;
    }
    EXPECT_EQ(rounded(weights), truth);
    EXPECT_EQ(integral_gap(weights, truth), 0.0);
  }
}

TEST(SumUpRounding, GapKeepsTheGuaranteeOnEqualAndRaggedGrids) {
  std::mt19937_64 random(2);
  double closest = 0.0;
  for (int trial = 0; trial < 4000; ++trial) {
    const int modes = 1 + static_cast<int>(random() % 9), intervals = 1 + static_cast<int>(random() % 60);
    const ModeWeights weights = test::random_weights(random, modes, intervals, trial % 2);
    std::vector<int> chosen;
    const SumUpReport report = sum_up_rounding(weights, chosen);
    ASSERT_EQ(report.status, Status::feasible);
    EXPECT_EQ(report.gap, integral_gap(weights, chosen));
    EXPECT_LE(report.gap, report.guarantee * (1 + 1e-12) + 1e-12) << trial;
    if (modes > 1) closest = std::max(closest, report.gap / report.guarantee);
  }
  EXPECT_GT(closest, 0.9);  // the property had something to refuse
}

TEST(SumUpRounding, TheGuaranteeCannotBeImproved) {
  for (int modes = 2; modes <= 12; ++modes) {
    const ModeWeights weights = worst_case(modes);
    std::vector<int> chosen;
    const SumUpReport report = sum_up_rounding(weights, chosen);
    EXPECT_NEAR(report.gap, report.guarantee, 1e-12) << modes;
  }
}

TEST(SumUpRounding, TheGapShrinksWithTheGrid) {
  // a(t) = (1 + sin t) / 2 by midpoints: half the interval, half the guarantee, and the gap below it.
  double before = 1e300;
  for (int intervals = 10; intervals <= 10 << 8; intervals *= 2) {
    const double dt = 12.0 / intervals;
    ModeWeights weights(2, std::vector<double>(static_cast<std::size_t>(intervals), dt));
    for (std::size_t k = 0; k < weights.intervals(); ++k) {
      weights.at(k, 1) = 0.5 + 0.5 * std::sin(dt * (static_cast<double>(k) + 0.5));
      weights.at(k, 0) = 1.0 - weights.at(k, 1);
    }
    std::vector<int> chosen;
    const SumUpReport report = sum_up_rounding(weights, chosen);
    EXPECT_DOUBLE_EQ(report.guarantee, 0.5 * dt);
    EXPECT_LE(report.gap, report.guarantee);
    EXPECT_LT(report.gap, before);
    before = report.gap;
  }
}

TEST(SumUpRounding, RefusesWhatIsNoWeightAndLeavesTheModesAlone) {
  std::vector<int> modes = {7};
  std::vector<double> owed(2);
  ModeWeights weights(2, {1.0});
  const auto status = [&](double a, double b) {
    weights.weight = {a, b};
    return sum_up_rounding(weights, modes, owed).status;
  };
  EXPECT_EQ(status(0.5, 0.4), Status::numerical_failure);
  EXPECT_EQ(status(-0.5, 1.5), Status::numerical_failure);
  EXPECT_EQ(status(std::nan(""), 1.0), Status::numerical_failure);
  weights.dt = {std::nan("")};
  EXPECT_EQ(status(0.5, 0.5), Status::numerical_failure);
  weights.dt = {0.0};
  EXPECT_EQ(status(0.5, 0.5), Status::numerical_failure);
  EXPECT_EQ(modes, std::vector<int>{7});
  weights.dt = {1.0};
  EXPECT_EQ(status(0.5, 0.5), Status::feasible);
}

TEST(ModeWeights, NormaliseMendsTolerancesAndNothingElse) {
  ModeWeights weights(3, {1.0, 1.0});
  weights.weight = {-1e-9, 0.5, 0.5 + 3e-8, 0.2, 0.2, 0.2};
  EXPECT_FALSE(is_normalised(weights));
  EXPECT_TRUE(normalise(weights));
  EXPECT_TRUE(is_normalised(weights));
  EXPECT_EQ(weights.at(0, 0), 0.0);
  EXPECT_NEAR(weights.at(1, 2), 1.0 / 3, 1e-15);
  weights.weight = {0.0, 0.0, 0.0, 0.2, 0.2, 0.2};
  EXPECT_FALSE(normalise(weights));
  weights.weight = {std::nan(""), 1.0, 0.0, 0.2, 0.2, 0.2};
  EXPECT_FALSE(normalise(weights));
}

}  // namespace
}  // namespace solenoid
