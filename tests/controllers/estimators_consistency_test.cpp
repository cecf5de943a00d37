#include "tests/support/drawn_world.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// Quantile of chi-square over its degrees of freedom, by Wilson and Hilferty (1931); z the normal quantile.
double chi_square_ratio(double degrees, double z) {
  const double a = 2.0 / (9.0 * degrees);
  return std::pow(1.0 - a + z * std::sqrt(a), 3);
}

double nees(const Belief& belief, const StateOf<LoadedActuator>& truth) {
  Eigen::Matrix<double, Belief::core, 1> error;
  for (int i = 0; i < Belief::core; ++i) error[i] = belief.mean[i] - truth[static_cast<std::size_t>(i)];
  const Eigen::Matrix<double, Belief::core, Belief::core> p =
      belief.covariance.topLeftCorner<Belief::core, Belief::core>();
  return error.dot(p.ldlt().solve(error));
}

/// Normalised estimation error squared over many drawn plants: at each moment its mean must lie inside the 95 % bounds
/// of chi-square with 8 x runs degrees of freedom, up to the moments that 5 % and the errors' memory allow outside.
/// Normalised innovation squared over runs and ticks likewise, with 3 degrees each.
TEST(EstimatorConsistency, NeesAndNisLieInsideTheir95PercentBounds) {
  constexpr int runs = 40, ticks = 4000, every = 50;
  const EstimatorTuning tuning = moderate_tuning();
  std::vector<double> sums(ticks / every, 0.0);
  double innovations = 0.0;
  for (int run = 0; run < runs; ++run) {
    DrawnWorld world(tuning, static_cast<std::uint64_t>(run) + 1);
    ActuatorKalman filter(PneumaticActuator(), tuning);
    for (int k = 0; k < ticks; ++k) {
      const Measurement s = world.sensors();
      filter.update(s);
      if (k > 0) innovations += filter.innovation();
      if (k % every == every - 1) sums[static_cast<std::size_t>(k / every)] += nees(filter.belief(), world.truth());
      world.advance(s);
      filter.applied(world.opening(), world.motor_n());
    }
    ASSERT_EQ(filter.starts(), 1) << "run " << run;
  }
  const double degrees = 8.0 * runs;
  const double low = 8 * chi_square_ratio(degrees, -1.96), high = 8 * chi_square_ratio(degrees, 1.96);
  int inside = 0;
  double mean = 0.0;
  for (const double sum : sums) {
    inside += sum / runs >= low && sum / runs <= high;
    mean += sum / runs / static_cast<double>(sums.size());
  }
  const double nis = innovations / (static_cast<double>(runs) * (ticks - 1));
  RecordProperty("nees_mean", std::to_string(mean));
  RecordProperty("nis_mean", std::to_string(nis));
  std::printf("NEES %.3f of 8, %d of %zu moments in [%.2f, %.2f]; NIS %.4f of 3\n", mean, inside, sums.size(), low,
              high, nis);
  EXPECT_GT(mean, low);
  EXPECT_LT(mean, high);
  EXPECT_GE(inside, static_cast<int>(0.85 * static_cast<double>(sums.size())));
  EXPECT_NEAR(nis, 3.0, 0.06);
}

}  // namespace
}  // namespace solenoid
