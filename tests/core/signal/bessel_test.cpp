#include "core/signal/bessel.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// Frequency response of the running filter from its impulse response.
std::complex<double> response(double cutoff_hz, double rate_hz, double frequency_hz) {
  Bessel8 filter(cutoff_hz, rate_hz);
  filter.reset(0.0);
  std::complex<double> sum;
  const int samples = static_cast<int>(20 * rate_hz / cutoff_hz);
  for (int n = 0; n < samples; ++n)
    sum += filter.step(n == 0 ? 1.0 : 0.0) * std::polar(1.0, -2 * std::numbers::pi * frequency_hz / rate_hz * n);
  return sum;
}

/// The reverse Bessel polynomial of order 8, sum_k (16 - k)! / (2^(8-k) k! (8-k)!) s^k.
std::complex<double> theta_8(std::complex<double> s) {
  const std::array<double, 9> theta = {2027025, 2027025, 945945, 270270, 51975, 6930, 630, 36, 1};
  std::complex<double> sum;
  for (std::size_t k = theta.size(); k-- > 0;) sum = sum * s + theta[k];
  return sum;
}

/// The closed form: theta_8(0) / theta_8(s), s scaled by the delay.
std::complex<double> closed_form(double cutoff_hz, double frequency_hz) {
  return theta_8(0.0) / theta_8({0.0, Bessel8::delay_times_cutoff_rad * frequency_hz / cutoff_hz});
}

double group_delay_s(double cutoff_hz, double rate_hz, double frequency_hz) {
  const double h = 0.05;
  const std::complex<double> ratio =
      response(cutoff_hz, rate_hz, frequency_hz + h) / response(cutoff_hz, rate_hz, frequency_hz - h);
  return -std::arg(ratio) / (2 * std::numbers::pi * 2 * h);
}

TEST(Bessel8, PolesAreTheRootsOfTheReverseBesselPolynomial) {
  double product = 1;
  for (const std::complex<double> pole : Bessel8::poles()) {
    EXPECT_LT(std::abs(theta_8(pole)), 1e-5 * std::abs(theta_8(0.0)));
    product *= std::norm(pole);
  }
  EXPECT_NEAR(product, 2027025.0, 1e-3);  // 15!!
}

TEST(Bessel8, IsTheReverseBesselPolynomialAtAFastSampleRate) {
  for (const double f : {0.0, 5.0, 20.0, 50.0, 100.0, 200.0})
    EXPECT_LT(std::abs(response(50.0, 100e3, f) - closed_form(50.0, f)), 2e-5) << f << " Hz";
  for (const double f : {5.0, 25.0, 75.0, 150.0})
    EXPECT_NEAR(std::abs(response(50.0, 10e3, f) / closed_form(50.0, f)), 1.0, 0.01) << f << " Hz";
}

TEST(Bessel8, LosesThreeDecibelsAtItsCutOff) {
  for (const double rate : {1e3, 10e3, 50e3})
    EXPECT_NEAR(std::norm(response(50.0, rate, 50.0)), 0.5, 1e-5) << rate << " Hz";
  for (const double cutoff : {20.0, 50.0, 200.0})
    EXPECT_NEAR(std::norm(response(cutoff, 10e3, cutoff)), 0.5, 1e-5) << cutoff << " Hz";
}

TEST(Bessel8, DelaysByTenMillisecondsFlatToTheCutOff) {
  const double delay_s = Bessel8::delay_times_cutoff_rad / (2 * std::numbers::pi * 50.0);
  EXPECT_NEAR(delay_s, 10.12e-3, 1e-5);
  for (const double f : {1.0, 5.0, 10.0, 20.0, 25.0, 40.0}) {
    EXPECT_NEAR(group_delay_s(50.0, 10e3, f), delay_s, 0.05e-3) << f << " Hz";
    EXPECT_NEAR(group_delay_s(50.0, 1e3, f), delay_s, 0.15e-3) << f << " Hz";
  }
}

TEST(Bessel8, HoldsAConstantFromReset) {
  Bessel8 filter(50.0, 1e3);
  filter.reset(101325.0);
  for (int n = 0; n < 1000; ++n) ASSERT_NEAR(filter.step(101325.0), 101325.0, 1e-5);
}

TEST(Bessel8, StepResponseOvershootsByLessThanHalfAPercent) {
  Bessel8 filter(50.0, 1e4);
  filter.reset(0.0);
  double most = 0.0, last = 0.0;
  for (int n = 0; n < 2000; ++n) most = std::max(most, last = filter.step(1.0));
  EXPECT_LT(most, 1.005);
  EXPECT_GT(most, 1.0);
  EXPECT_NEAR(last, 1.0, 1e-9);
}

}  // namespace
}  // namespace solenoid
