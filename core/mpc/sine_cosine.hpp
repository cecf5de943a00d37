#pragma once

#include <numbers>

namespace solenoid {

/// The sine and the cosine of one angle.
template <class S>
struct SineCosine {
  S sine, cosine;
};

/// The whole number nearest to t, |t| < 2^51, ties to even: the spacing of doubles near 1.5 * 2^52 is 1. It is constant
/// between its jumps, so a dual number (anything with a value()) loses its derivative.
template <class S>
S nearest_whole(const S& t) {
  if constexpr (requires { t.value(); }) {
    return S(nearest_whole(t.value()));
  } else {
    const S shift(0x1.8p52);
    return (t + shift) - shift;
  }
}

/// Sine and cosine [rad] by sums and products alone, so that double, SIMD and dual numbers round alike: std::sin and
/// the vector libraries' do not. Off by less than 2e-15 for |angle| < 1e3.
///
///     r = angle - 2 pi k,  k whole,  |r| <= pi;     q = r/4,  |q| <= pi/4
///     sin q, cos q by their Taylor sums to q^15 and q^16: rest below 5e-17
///     sin 2a = 2 sin a cos a,  cos 2a = 1 - 2 sin^2 a,  twice
///
/// 2 pi is cut in two, 6.28125 (eight bits) and the rest, so that the product with k loses nothing (Cody and Waite,
/// Software Manual for the Elementary Functions, 1980).
template <class S>
SineCosine<S> sine_cosine(const S& angle) {
  const S turns = nearest_whole<S>(angle * S(0.5 * std::numbers::inv_pi));
  const S rest = (angle - turns * S(6.28125)) - turns * S(1.9353071795864769e-3);
  const S q = S(0.25) * rest, z = q * q, z2 = z * z, z4 = z2 * z2;

  const S s03 = (S(1.0) - S(1.0 / 6) * z) + z2 * (S(1.0 / 120) - S(1.0 / 5040) * z);
  const S s47 = (S(1.0 / 362880) - S(1.0 / 39916800) * z) + z2 * (S(1.0 / 6227020800) - S(1.0 / 1307674368000) * z);
  const S c03 = (S(1.0) - S(0.5) * z) + z2 * (S(1.0 / 24) - S(1.0 / 720) * z);
  const S c48 = (S(1.0 / 40320) - S(1.0 / 3628800) * z) +
                z2 * ((S(1.0 / 479001600) - S(1.0 / 87178291200) * z) + S(1.0 / 20922789888000) * z2);
  const S sine = q * (s03 + z4 * s47), cosine = c03 + z4 * c48;

  const S sine2 = S(2.0) * (sine * cosine), cosine2 = S(1.0) - S(2.0) * (sine * sine);
  return {S(S(2.0) * (sine2 * cosine2)), S(S(1.0) - S(2.0) * (sine2 * sine2))};
}

}  // namespace solenoid
