#include "core/signal/bessel.hpp"

#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using Complex = std::complex<double>;

/// Reverse Bessel polynomial theta_8(s) = sum_k (16 - k)! / (2^(8-k) k! (8-k)!) s^k.
Complex theta_8(Complex s) {
  Complex sum = 0, power = 1;
  for (int k = 0; k <= 8; ++k) {
    sum += std::tgamma(17 - k) / (std::exp2(8 - k) * std::tgamma(k + 1) * std::tgamma(9 - k)) * power;
    power *= s;
  }
  return sum;
}

/// Response of the filter to exp(i w t) once it has settled, by driving its real and imaginary parts.
Complex response(double cutoff_hz, double rate_hz, double frequency_hz) {
  Bessel8 real(cutoff_hz, rate_hz), imaginary(cutoff_hz, rate_hz);
  const double w = 2 * std::numbers::pi * frequency_hz / rate_hz;
  const int samples = static_cast<int>(rate_hz);
  Complex out = 0;
  for (int n = 0; n <= samples; ++n) out = {real.step(std::cos(w * n)), imaginary.step(std::sin(w * n))};
  return out / std::polar(1.0, w * samples);
}

TEST(Bessel8, PolesAreTheRootsOfTheReverseBesselPolynomial) {
  Complex product = 1;
  for (const Complex pole : Bessel8::poles()) {
    EXPECT_LT(std::abs(theta_8(pole)), 1e-5 * std::abs(theta_8(0.0)));
    product *= std::norm(pole);
  }
  EXPECT_NEAR(product.real(), 2027025.0, 1e-3);  // 15!!
}

TEST(Bessel8, HalvesThePowerAtItsCutoff) {
  for (const double cutoff : {20.0, 50.0, 200.0})
    EXPECT_NEAR(std::norm(response(cutoff, 10000.0, cutoff)), 0.5, 1e-6) << cutoff;
}

TEST(Bessel8, DelaysEveryFrequencyBelowItsCutoffByTenMilliseconds) {
  const double expected_s = Bessel8::delay_times_cutoff_rad / (2 * std::numbers::pi * 50.0);
  EXPECT_NEAR(expected_s, 0.0101, 5e-5);
  for (const double frequency : {1.0, 5.0, 10.0, 20.0, 40.0}) {
    const double step = 0.01;
    const double phase =
        std::arg(response(50.0, 10000.0, frequency + step) / response(50.0, 10000.0, frequency - step));
    const double group_delay_s = -phase / (2 * std::numbers::pi * 2 * step);
    EXPECT_NEAR(group_delay_s, expected_s, 0.005 * expected_s) << frequency << " Hz";
  }
}

TEST(Bessel8, FollowsTheAnalogPrototypeInMagnitude) {
  const double tau = Bessel8::delay_times_cutoff_rad / (2 * std::numbers::pi * 50.0);
  for (const double frequency : {5.0, 25.0, 75.0, 150.0}) {
    const Complex s(0, 2 * std::numbers::pi * frequency * tau);
    const double analog = std::abs(theta_8(0.0) / theta_8(s));
    EXPECT_NEAR(std::abs(response(50.0, 10000.0, frequency)) / analog, 1.0, 0.01) << frequency << " Hz";
  }
}

TEST(Bessel8, ResetStartsSettled) {
  Bessel8 filter(50.0, 10000.0);
  filter.reset(123456.0);
  for (int n = 0; n < 1000; ++n) EXPECT_NEAR(filter.step(123456.0), 123456.0, 1e-6);
}

}  // namespace
}  // namespace solenoid
