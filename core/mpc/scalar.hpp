#pragma once

#include <array>
#include <cstddef>

namespace solenoid {

/// A vector of compile-time length over any scalar: double, a SIMD batch (one candidate a lane), a dual number.
template <class Scalar, std::size_t size>
using Vector = std::array<Scalar, size>;

/// condition ? yes : no, evaluated on both sides. Models branch through this and never through `if`, so that one
/// formula serves double and dual numbers (this overload) and SIMD batches (xsimd::select, found by the batch's
/// namespace). Likewise they take max, min and sqrt unqualified, after `using std::max` and so on.
template <class Scalar>
constexpr Scalar select(bool condition, const Scalar& yes, const Scalar& no) {
  return condition ? yes : no;
}

}  // namespace solenoid
