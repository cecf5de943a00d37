#pragma once

#include "core/mpc/scalar.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

namespace solenoid {

class TableReader;

/// A piecewise linear function of one number that is zero outside its knots, a sum of hats: what is left of a function
/// that was found from data once it has to be evaluated in every step of every prediction.
///
///     f(x) = sum_i b_i max(x - t_i, 0)   for t_0 < x < t_n-1,   0 elsewhere;   b_i: by how much the slope bends at t_i
///
/// It branches through select alone, so lanes of a SIMD batch, dual numbers and double take the same way. Nothing is
/// allocated.
class HatSum {
 public:
  static constexpr std::size_t most_knots = 24;

  /// The function that is zero everywhere.
  HatSum() = default;
  /// Through these values at increasing knots; the first and the last value must be zero. Throws std::invalid_argument.
  HatSum(std::span<const double> knots, std::span<const double> values);

  bool empty() const noexcept { return size_ == 0; }
  std::span<const double> knots() const noexcept { return {knots_.data(), size_}; }
  std::span<const double> values() const noexcept { return {values_.data(), size_}; }
  /// Whether x is between the first and the last knot.
  bool covers(double x) const noexcept { return low_ < x && x < high_; }

  template <class S>
  S at(const S& x) const {
    using std::max;
    // Four sums, so that no addition waits for all that are before it: a step's latency is a prediction's.
    Vector<S, 4> sum = {S(0.0), S(0.0), S(0.0), S(0.0)};
    for (std::size_t i = 0; i < size_; i += 4)
      for (std::size_t k = 0; k < 4; ++k) sum[k] = sum[k] + S(bends_[i + k]) * S(max(S(x - S(knots_[i + k])), S(0.0)));
    const S whole = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    return select((x > S(low_)) & (x < S(high_)), whole, S(0.0));
  }

  /// The least and the greatest value over [low, high], up to rounding: those at its ends and at the knots inside.
  template <class S>
  Vector<S, 2> range(const S& low, const S& high) const {
    using std::max, std::min;
    const S first = at<S>(low), last = at<S>(high);
    Vector<S, 2> found = {S(min(first, last)), S(max(first, last))};
    for (std::size_t i = 0; i < size_; ++i) {
      const auto inside = (low < S(knots_[i])) & (S(knots_[i]) < high);
      found[0] = select(inside, S(min(found[0], S(values_[i]))), found[0]);
      found[1] = select(inside, S(max(found[1], S(values_[i]))), found[1]);
    }
    return found;
  }

  bool operator==(const HatSum&) const = default;

 private:
  std::array<double, most_knots> knots_{}, values_{}, bends_{};  // behind the last knot zeros: they add nothing
  std::size_t size_ = 0;
  double low_ = 0.0, high_ = 0.0;
};

/// A force on the slide [N], towards +y, that a model of the actuator leaves out and that depends on the state, as it was
/// identified from logs:
///
///     g(y, v) = g_v(v) + g_y(y)                                                             [residual.md, section 1]
///
/// Each share is zero where there were no data. At v = 0 g_v is zero up to rounding: there stiction is the model's own.
struct ForceResidual {
  HatSum velocity;  ///< g_v over [m/s]
  HatSum position;  ///< g_y over [m]

  bool empty() const noexcept { return velocity.empty() && position.empty(); }

  template <class S>
  S force(const S& y, const S& v) const {
    return velocity.at<S>(v) + position.at<S>(y);
  }
  /// Bounds of the force over a box.
  template <class S>
  Vector<S, 2> range(const S& y_low, const S& y_high, const S& v_low, const S& v_high) const {
    const Vector<S, 2> of_v = velocity.range<S>(v_low, v_high), of_y = position.range<S>(y_low, y_high);
    return {S(of_v[0] + of_y[0]), S(of_v[1] + of_y[1])};
  }
  /// Whether the data it was identified from reach here: at rest, by the position alone.
  bool covers(double y, double v) const noexcept {
    return (velocity.empty() || v == 0.0 || velocity.covers(v)) && (position.empty() || position.covers(y));
  }

  bool operator==(const ForceResidual&) const = default;
};

/// Reads `velocity = { knots_m_s, force_n }` and `position = { knots_m, force_n }`, each of which may be missing; a table
/// `identified` says where they are from and is not looked at. Finishes the table. Throws ConfigError.
ForceResidual read_force_residual(TableReader& table);

}  // namespace solenoid
