#pragma once

#include "core/mpc/sine_cosine.hpp"

#include <cmath>
#include <type_traits>

#include <xsimd/xsimd.hpp>

namespace solenoid {

/// Functions of models, for every scalar: doubles, SIMD batches, dual numbers, Eigen's AutoDiffScalar. The standard
/// library's and the vector library's differ in the last bit, and a search's lanes have to agree with the scalar
/// rollout: so a double goes through the vector library too, as one lane of a register. Exponential, logarithm and hyperbolic tangent are within
/// 2 units in the last place, powers within 8, sine and cosine off by less than 2e-15 for |angle| < 1e3.
///
/// They agree without fused sums only: not in a batch for AVX-512.
namespace model_functions_detail {

#if defined(__x86_64__)
/// A double, as the vector library computes with it.
using OneLane = xsimd::batch<double, xsimd::sse2>;
#else
/// A double, as the vector library computes with it.
using OneLane = xsimd::batch<double>;
#endif

/// A function of the vector library, of doubles too.
template <class S, class Function>
S same_in_every_lane(const S& x, Function function) {
  if constexpr (std::is_same_v<S, double>)
    return function(OneLane(x)).get(0);
  else
    return function(x);
}

}  // namespace model_functions_detail

/// exp(x).
template <class S>
S exponential(const S& x) {
  return model_functions_detail::same_in_every_lane(x, [](const auto& v) {
    using xsimd::exp;
    return exp(v);
  });
}
/// The natural logarithm.
template <class S>
S logarithm(const S& x) {
  return model_functions_detail::same_in_every_lane(x, [](const auto& v) {
    using xsimd::log;
    return log(v);
  });
}
/// tanh(x).
template <class S>
S hyperbolic_tangent(const S& x) {
  return model_functions_detail::same_in_every_lane(x, [](const auto& v) {
    using xsimd::tanh;
    return tanh(v);
  });
}
/// x^exponent for x >= 0.
template <class S>
S power(const S& x, double exponent) {
  return model_functions_detail::same_in_every_lane(x, [exponent]<class V>(const V& v) {
    if constexpr (xsimd::is_batch<V>::value)
      return V(xsimd::pow(v, V(exponent)));
    else
      return V(pow(v, exponent));
  });
}
/// The root of x >= 0. The derivative at 0 is a large number and not infinite, so that its product with one that is 0 is.
template <class S>
S square_root(const S& x) {
  if constexpr (requires { x.value(); }) {
    using Value = std::remove_cvref_t<decltype(x.value())>;  // with derivatives itself, where second ones are wanted
    const Value root = square_root(x.value());
    const Value slope = root < 1e-15 ? Value(0.5 / 1e-15) : Value(0.5 / root);
    if constexpr (requires { x.chained(root, slope); })
      return x.chained(root, slope);
    else
      return S(root, x.derivatives() * slope);  // Eigen's, of the filters
  } else {
    using std::sqrt;
    return sqrt(x);
  }
}
/// sin(angle).
template <class S>
S sine(const S& angle) {
  return sine_cosine<S>(angle).sine;
}
/// cos(angle).
template <class S>
S cosine(const S& angle) {
  return sine_cosine<S>(angle).cosine;
}

}  // namespace solenoid
