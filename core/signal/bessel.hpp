#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <numbers>

namespace solenoid {

/// One second-order section, direct form II transposed:  y = b0 x + b1 x' + b2 x'' - a1 y' - a2 y''.
struct Biquad {
  double b0 = 1, b1 = 0, b2 = 0, a1 = 0, a2 = 0;
  double s1 = 0, s2 = 0;

  double step(double x) {
    const double y = b0 * x + s1;
    s1 = b1 * x - a1 * y + s2;
    s2 = b2 * x - a2 * y;
    return y;
  }
  /// Starts as if input and output had always been `value`; for sections of unit gain at rest.
  void reset(double value) {
    s1 = value * (1 - b0);
    s2 = value * (b2 - a2);
  }
};

/// Eighth-order low-pass Bessel filter as four biquads: maximally flat group delay.
///
///     H(s) = 15!! / theta_8(s tau),   theta_8 the reverse Bessel polynomial,   tau = 3.17962 / (2 pi f_c)
///
/// f_c is where |H| = -3 dB, tau the group delay at low frequency: 10.1 ms at 50 Hz. By the bilinear transform,
/// pre-warped at f_c. The pressure filters of the thesis (MAX292, section 3.5) are this filter at 50 Hz.
///
/// The poles are the published roots of theta_8 (e.g. C. R. Bond, Bessel filter constants), 12 digits.
class Bessel8 {
 public:
  static constexpr double delay_times_cutoff_rad = 3.17961723751;  ///< tau 2 pi f_c

  /// Upper half of the poles of H for tau = 1 s.
  static constexpr std::array<std::complex<double>, 4> poles() {
    return {{{-5.587886043263, 0.867614445353},
             {-5.204840790636, 2.616175152642},
             {-4.368289217202, 4.414442500471},
             {-2.838983948897, 6.353911298604}}};
  }

  Bessel8(double cutoff_hz, double sample_rate_hz) {
    // The bilinear transform maps s to (z - 1)/(z + 1) / w with w = tan(pi f_c / f_s) at the cut-off.
    const double w = std::tan(std::numbers::pi * cutoff_hz / sample_rate_hz) / delay_times_cutoff_rad;
    std::size_t i = 0;
    for (const std::complex<double> pole : poles()) {
      const double sum = -2 * pole.real() * w, product = std::norm(pole) * w * w;
      const double scale = 1.0 / (1 + sum + product);
      sections_[i++] = {product * scale, 2 * product * scale, product * scale, 2 * (product - 1) * scale,
                        (1 - sum + product) * scale};
    }
  }

  void reset(double value) {
    for (Biquad& section : sections_) section.reset(value);
  }
  double step(double x) {
    for (Biquad& section : sections_) x = section.step(x);
    return x;
  }

 private:
  std::array<Biquad, 4> sections_;
};

}  // namespace solenoid
