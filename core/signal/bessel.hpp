#pragma once

#include <array>
#include <complex>
#include <numbers>

namespace solenoid {

/// Eighth-order Bessel low-pass filter, the MAX292 of the rig's pressure channels (section 3.4 of the thesis).
///
///     H(s) = prod_i |p_i|^2 w_c^2 / (s^2 - 2 Re(p_i) w_c s + |p_i|^2 w_c^2),   w_c = 2 pi cutoff,   |H(j w_c)|^2 = 1/2
///
/// p_i are the four upper poles of the maximally flat delay (Thomson 1949), scaled to 3 dB at 1 rad/s. Unit gain at
/// rest, group delay 3.179617 / w_c up to about the cut-off: 10.12 ms at 50 Hz. Four bilinear biquads without
/// pre-warping, which keeps the delay at rest exact at any sample rate; the cut-off moves by (pi cutoff/rate)^2 / 3.
class Bessel8 {
 public:
  static constexpr std::size_t order = 8, pairs = order / 2;
  /// Group delay at rest times the cut-off in rad/s.
  static constexpr double normalised_delay = 3.179617237510652;

  /// Upper half of the pole pairs, 3 dB at 1 rad/s.
  static constexpr std::array<std::complex<double>, pairs> poles() {
    return {{{-1.7574084004017008, 0.2728675751020118},
             {-1.6369394181267511, 0.8227956251396886},
             {-1.3738412176373573, 1.3883565758775636},
             {-0.892869718847131, 1.9983258436412963}}};
  }
  static constexpr double delay_s(double cutoff_hz) { return normalised_delay / (2 * std::numbers::pi * cutoff_hz); }

  Bessel8(double cutoff_hz, double sample_rate_hz) {
    const double cutoff = 2 * std::numbers::pi * cutoff_hz, k = 2 * sample_rate_hz;
    for (std::size_t i = 0; i < pairs; ++i) {
      const double square = std::norm(poles()[i]) * cutoff * cutoff, damping = -2 * poles()[i].real() * cutoff;
      const double scale = 1.0 / (k * k + damping * k + square);
      sections_[i].gain = square * scale;
      sections_[i].a1 = 2 * (square - k * k) * scale;
      sections_[i].a2 = (k * k - damping * k + square) * scale;
    }
  }

  /// Starts as if the input had always been `value`.
  void reset(double value) {
    for (Section& s : sections_) s.x1 = s.x2 = s.y1 = s.y2 = value;
  }

  double step(double x) {
    for (Section& s : sections_) {
      const double y = s.gain * (x + 2 * s.x1 + s.x2) - s.a1 * s.y1 - s.a2 * s.y2;
      s.x2 = s.x1;
      s.x1 = x;
      s.y2 = s.y1;
      s.y1 = y;
      x = y;
    }
    return x;
  }

 private:
  struct Section {
    double gain = 0, a1 = 0, a2 = 0;
    double x1 = 0, x2 = 0, y1 = 0, y2 = 0;
  };
  std::array<Section, pairs> sections_;
};

}  // namespace solenoid
