#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace solenoid {

/// A square matrix of compile-time size, entry [row][column].
template <std::size_t n>
using SquareMatrix = std::array<std::array<double, n>, n>;

/// What exp and its relatives are made of.
namespace matrix_exponential_detail {

/// a b.
template <std::size_t n>
SquareMatrix<n> product(const SquareMatrix<n>& a, const SquareMatrix<n>& b) {
  SquareMatrix<n> c{};
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t j = 0; j < n; ++j) c[i][j] += a[i][k] * b[k][j];
  return c;
}

/// The largest sum of magnitudes in a row.
template <std::size_t n>
double norm(const SquareMatrix<n>& a) {
  double most = 0.0;
  for (const auto& row : a) {
    double sum = 0.0;
    for (const double entry : row) sum += std::abs(entry);
    most = std::max(most, sum);
  }
  return most;
}

}  // namespace matrix_exponential_detail

/// phi_0 to phi_{count-1} of a square matrix A,
///
///     phi_k(A) = sum_j A^j / (j + k)!,     phi_0 = exp,     A phi_{k+1} = phi_k - I/k!
///
/// By their series at A / 2^s, of norm below 1/2, where sixteen terms leave less than 1e-19, and s doublings:
///
///     phi_k(2 A) = 2^-k (exp(A) phi_k(A) + sum_{j=1..k} phi_j(A) / (k - j)!)
///
/// Nothing is allocated. A matrix with an entry that is no number, or whose norm is beyond 2^60, gives NaN.
template <std::size_t n, std::size_t count>
std::array<SquareMatrix<n>, count> phi_functions(SquareMatrix<n> a) {
  using matrix_exponential_detail::product;
  std::array<SquareMatrix<n>, count> phi{};
  const double size = matrix_exponential_detail::norm<n>(a);
  if (!(size < 0x1p60)) {
    for (auto& of : phi)
      for (auto& row : of) row.fill(std::nan(""));
    return phi;
  }
  const int doublings = size > 0.5 ? static_cast<int>(std::ceil(std::log2(size))) + 1 : 0;
  for (auto& row : a)
    for (double& entry : row) entry = std::ldexp(entry, -doublings);

  std::array<double, count> factorial{};  // k!
  factorial[0] = 1.0;
  for (std::size_t k = 1; k < count; ++k) factorial[k] = static_cast<double>(k) * factorial[k - 1];
  SquareMatrix<n> power{};  // A^j
  for (std::size_t i = 0; i < n; ++i) power[i][i] = 1.0;
  std::array<double, count> coefficient{};  // 1/(j + k)!
  for (std::size_t k = 0; k < count; ++k) coefficient[k] = 1.0 / factorial[k];
  for (int j = 0; j < 16; ++j) {
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t row = 0; row < n; ++row)
        for (std::size_t column = 0; column < n; ++column) phi[k][row][column] += coefficient[k] * power[row][column];
      coefficient[k] /= j + 1.0 + static_cast<double>(k);
    }
    power = product<n>(power, a);
  }

  for (int s = 0; s < doublings; ++s) {
    const std::array<SquareMatrix<n>, count> half = phi;
    for (std::size_t k = 0; k < count; ++k) {
      phi[k] = product<n>(half[0], half[k]);
      for (std::size_t row = 0; row < n; ++row)
        for (std::size_t column = 0; column < n; ++column) {
          double& entry = phi[k][row][column];
          for (std::size_t j = 1; j <= k; ++j) entry += half[j][row][column] / factorial[k - j];
          entry = std::ldexp(entry, -static_cast<int>(k));
        }
    }
  }
  return phi;
}

}  // namespace solenoid
