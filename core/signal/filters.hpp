#pragma once

#include <cmath>
#include <numbers>

namespace solenoid {

/// Second-order low-pass Butterworth filter by the bilinear transform, pre-warped at the cut-off.
///
///     |H(f)|^2 = 1 / (1 + (f / f_c)^4),   unit gain at rest;   delay at low frequency about sqrt(2) / (2 pi f_c)
///
/// At 50 Hz and 1 kHz it is the position filter of the thesis (section 3.5).
class Butterworth2 {
 public:
  Butterworth2(double cutoff_hz, double sample_rate_hz) {
    const double w = std::tan(std::numbers::pi * cutoff_hz / sample_rate_hz);
    const double scale = 1.0 / (1.0 + std::numbers::sqrt2 * w + w * w);
    b0_ = w * w * scale;
    a1_ = 2.0 * (w * w - 1.0) * scale;
    a2_ = (1.0 - std::numbers::sqrt2 * w + w * w) * scale;
  }

  /// Starts as if the input had always been `value`.
  void reset(double value) { x1_ = x2_ = y1_ = y2_ = value; }

  double step(double x) {
    const double y = b0_ * (x + 2.0 * x1_ + x2_) - a1_ * y1_ - a2_ * y2_;
    x2_ = x1_;
    x1_ = x;
    y2_ = y1_;
    y1_ = y;
    return y;
  }

 private:
  double b0_, a1_, a2_;
  double x1_ = 0, x2_ = 0, y1_ = 0, y2_ = 0;
};

/// Backward difference, (5.3): (y(i) - y(i - 1)) / T_s, zero at the first sample after reset.
class BackwardDifference {
 public:
  explicit BackwardDifference(double period_s) : period_s_(period_s) {}
  void reset(double value) { previous_ = value; }
  double step(double value) {
    const double rate = (value - previous_) / period_s_;
    previous_ = value;
    return rate;
  }

 private:
  double period_s_;
  double previous_ = 0.0;
};

/// Rounds to the nearest level of a converter with `bits` over [low, high], saturating at its ends.
class Quantiser {
 public:
  Quantiser(double low, double high, int bits) : low_(low), high_(high), step_((high - low) / (std::exp2(bits) - 1)) {}
  double operator()(double value) const {
    const double level = std::round((value - low_) / step_);
    return std::fmin(high_, std::fmax(low_, low_ + level * step_));
  }
  double step() const { return step_; }

 private:
  double low_, high_, step_;
};

}  // namespace solenoid
