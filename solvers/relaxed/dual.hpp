#pragma once

#include "core/mpc/flatten.hpp"

#include <cmath>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

namespace solenoid {

/// A number with its derivatives in `directions` directions: forward differentiation through a model's one formula.
///
/// Derivatives live in registers of `lanes` doubles, and every operation is straight code over them, free of fused
/// sums: derivatives are the same to the last bit whatever the registers. Those known to be zero when a formula is
/// compiled, its constants' and those of directions that cannot matter yet, cost nothing.
template <int directions, int lanes = 2>
class Dual {
 public:
  static_assert(directions > 0 && (lanes == 2 || lanes == 4));
  /// Directions, rounded up to whole registers.
  static constexpr int size = (directions + lanes - 1) / lanes * lanes;

  Dual() : Dual(0.0) {}
  Dual(double value) : value_(value) {  // not explicit: models mix their constants in
    each([&](auto i) { d_[i] = Register{}; });
  }
  /// A variable: derivative `scale` in direction `at`.
  Dual(double value, int at, double scale = 1.0) : Dual(value) {
    d_[static_cast<std::size_t>(at / lanes)][at % lanes] = scale;
  }
  Dual(const Dual& b) : value_(b.value_) {  // register by register, and not as a block of memory
    each([&](auto i) { d_[i] = b.d_[i]; });
  }
  Dual& operator=(const Dual& b) {
    value_ = b.value_;
    each([&](auto i) { d_[i] = b.d_[i]; });
    return *this;
  }

  double value() const { return value_; }
  /// All `size` derivatives.
  void copy_derivatives(double* out) const {
    each([&](auto i) { std::memcpy(out + i * lanes, &d_[i], sizeof(Register)); });
  }

  friend Dual operator+(const Dual& a, const Dual& b) {
    Dual out(a.value_ + b.value_);
    each([&](auto i) { out.set_sum(i, a.d_[i], b.d_[i]); });
    return out;
  }
  friend Dual operator-(const Dual& a, const Dual& b) {
    Dual out(a.value_ - b.value_);
    each([&](auto i) {
      if (is_zero(b.d_[i]))
        out.d_[i] = a.d_[i];
      else if (is_zero(a.d_[i]))
        out.d_[i] = -b.d_[i];
      else
        out.d_[i] = a.d_[i] - b.d_[i];
    });
    return out;
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    return combined(a.value_ * b.value_, b.value_, a, a.value_, b);
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double per = 1.0 / b.value_, ratio = a.value_ * per;
    return combined(ratio, per, a, -ratio * per, b);
  }
  Dual operator-() const { return chained(-value_, -1.0); }
  friend Dual operator+(const Dual& a, double b) { return a.chained(a.value_ + b, 1.0); }
  friend Dual operator+(double a, const Dual& b) { return b.chained(a + b.value_, 1.0); }
  friend Dual operator-(const Dual& a, double b) { return a.chained(a.value_ - b, 1.0); }
  friend Dual operator-(double a, const Dual& b) { return b.chained(a - b.value_, -1.0); }
  friend Dual operator*(const Dual& a, double b) { return a.chained(a.value_ * b, b); }
  friend Dual operator*(double a, const Dual& b) { return b.chained(a * b.value_, a); }
  friend Dual operator/(const Dual& a, double b) { return a.chained(a.value_ / b, 1.0 / b); }
  friend Dual operator/(double a, const Dual& b) { return Dual(a) / b; }
  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }
  Dual& operator/=(const Dual& b) { return *this = *this / b; }

  friend bool operator<(const Dual& a, const Dual& b) { return a.value_ < b.value_; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.value_ > b.value_; }
  friend bool operator<=(const Dual& a, const Dual& b) { return a.value_ <= b.value_; }
  friend bool operator>=(const Dual& a, const Dual& b) { return a.value_ >= b.value_; }
  friend bool operator==(const Dual& a, const Dual& b) { return a.value_ == b.value_; }
  friend bool operator!=(const Dual& a, const Dual& b) { return a.value_ != b.value_; }

  /// f(*this), of a function with this value and this slope here.
  Dual chained(double value, double slope) const {
    Dual out(value);
    each([&](auto i) {
      if (!is_zero(d_[i])) out.d_[i] = slope * d_[i];
    });
    return out;
  }

 private:
  typedef double Register __attribute__((vector_size(lanes * sizeof(double))));
  static constexpr std::size_t registers = static_cast<std::size_t>(size / lanes);

  template <class Each>
  static void each(const Each& work) {
    [&]<std::size_t... i>(std::index_sequence<i...>) { (work(std::integral_constant<std::size_t, i>{}), ...); }
    (std::make_index_sequence<registers>());
  }

  /// Whether the compiler can tell that it is.
  static bool is_zero(const Register& d) {
    if constexpr (lanes == 2)
      return knows_zero(d, 0) && knows_zero(d, 1);
    else
      return knows_zero(d, 0) && knows_zero(d, 1) && knows_zero(d, 2) && knows_zero(d, 3);
  }
  template <class Lanes>
  static bool knows_zero(const Lanes& d, int lane) {
    return __builtin_constant_p(d[lane]) && d[lane] == 0.0;
  }
  void set_sum(std::size_t i, const Register& a, const Register& b) {
    if (is_zero(a))
      d_[i] = b;
    else if (is_zero(b))
      d_[i] = a;
    else
      d_[i] = a + b;
  }
  /// Derivatives by_a a' + by_b b'.
  static Dual combined(double value, double by_a, const Dual& a, double by_b, const Dual& b) {
    Dual out(value);
    each([&](auto i) {
      if (is_zero(a.d_[i])) {
        if (!is_zero(b.d_[i])) out.d_[i] = by_b * b.d_[i];
      } else if (is_zero(b.d_[i])) {
        out.d_[i] = by_a * a.d_[i];
      } else {
        out.d_[i] = by_a * a.d_[i] + by_b * b.d_[i];
      }
    });
    return out;
  }

  double value_;
  Register d_[registers];
};

/// @name Functions of dual numbers
/// @{

/// The function by the chain rule; at a kink with the derivative of one side.
template <int n, int w>
Dual<n, w> max(const Dual<n, w>& a, const Dual<n, w>& b) {
  return a < b ? b : a;
}
template <int n, int w>
Dual<n, w> min(const Dual<n, w>& a, const Dual<n, w>& b) {
  return b < a ? b : a;
}
template <int n, int w>
Dual<n, w> abs(const Dual<n, w>& x) {
  return x.chained(std::abs(x.value()), x.value() < 0.0 ? -1.0 : 1.0);
}
template <int n, int w>
Dual<n, w> sqrt(const Dual<n, w>& x) {
  const double root = std::sqrt(x.value());
  return x.chained(root, 0.5 / root);
}
template <int n, int w>
Dual<n, w> exp(const Dual<n, w>& x) {
  const double value = std::exp(x.value());
  return x.chained(value, value);
}
template <int n, int w>
Dual<n, w> log(const Dual<n, w>& x) {
  return x.chained(std::log(x.value()), 1.0 / x.value());
}
template <int n, int w>
Dual<n, w> pow(const Dual<n, w>& x, double exponent) {
  return x.chained(std::pow(x.value(), exponent), exponent * std::pow(x.value(), exponent - 1.0));
}
template <int n, int w>
Dual<n, w> sin(const Dual<n, w>& x) {
  return x.chained(std::sin(x.value()), std::cos(x.value()));
}
template <int n, int w>
Dual<n, w> cos(const Dual<n, w>& x) {
  return x.chained(std::cos(x.value()), -std::sin(x.value()));
}
template <int n, int w>
Dual<n, w> tanh(const Dual<n, w>& x) {
  const double value = std::tanh(x.value());
  return x.chained(value, 1.0 - value * value);
}
/// @}

/// Calls that differentiate are compiled twice, for registers of two doubles and for the four of AVX2, and chosen at
/// run time: body(lanes) as a constant.
///
/// Everything is inlined into the copy for AVX2: what is not would be compiled for any processor.
template <class Body>
[[gnu::noinline]] void with_two_lanes(const Body& body) {
  body(std::integral_constant<int, 2>{});
}
#if defined(__x86_64__)
template <class Body>
[[SOLENOID_FLATTEN, gnu::noinline, gnu::target("avx2")]] void with_four_lanes(const Body& body) {
  body(std::integral_constant<int, 4>{});
}
/// Calls body with the widest of them that this processor has.
template <class Body>
void with_best_lanes(const Body& body) {
  __builtin_cpu_supports("avx2") ? with_four_lanes(body) : with_two_lanes(body);
}
#else
/// Calls body with the only one that there is.
template <class Body>
void with_best_lanes(const Body& body) {
  with_two_lanes(body);
}
#endif

}  // namespace solenoid
