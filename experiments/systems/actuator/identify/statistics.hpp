#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace solenoid {

/// Quantile of Student's t: P(|T| <= it) = confidence.
double student_quantile(double freedom, double confidence = 0.95);

double mean_of(std::span<const double> x);
/// Sample standard deviation, n - 1.
double deviation_of(std::span<const double> x);

/// Variance of the mean of a stationary series whose values are correlated, by Newey and West (1987) with Bartlett's
/// weights over `lags`:  (gamma_0 + 2 sum_l (1 - l/(lags + 1)) gamma_l) / n.
double variance_of_mean(std::span<const double> x, int lags);
/// Degrees of freedom behind such a variance, 1.5 n / lags (Bartlett's window; Priestley 1981, table 6.1).
double newey_west_freedom(std::size_t n, int lags);

/// A least-squares problem: minimise |r(x)|^2. Residuals come in series, each evenly sampled; across series they are
/// independent.
struct LeastSquares {
  std::function<void(const Eigen::VectorXd& x, Eigen::VectorXd& residuals)> residuals;
  std::vector<std::size_t> series;  ///< lengths; their sum is the number of residuals
  Eigen::VectorXd start, scale;     ///< of x; derivatives are differences over step * scale
  int lags = 0;                     ///< residuals further apart are uncorrelated
  double step = 1e-3;
};

struct LeastSquaresFit {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;
  Eigen::VectorXd residuals;
  double freedom = 0.0, rms = 0.0;
  bool converged = false;
  double sigma(int i) const;
};

/// Levenberg and Marquardt's method (Eigen's, after MINPACK), and the Gauss-Newton covariance for residuals that are
/// correlated in time and not equally large everywhere (White 1980, Newey and West 1987):
///
///     C = H S H,   H = (J'J)^-1,   S = sum_l w_l sum_t (g_t g_{t+l}' + its transpose),   g_t = J_t' r_t,
///
/// Bartlett's weights w_l over `lags`, times n/(n - p). What filters do to noise, and jitter of an edge that all
/// samples after it share, are both in S.
LeastSquaresFit solve_least_squares(const LeastSquares& problem);

/// The same for r = y - X b, without iterations.
LeastSquaresFit solve_linear(const Eigen::MatrixXd& x, const Eigen::VectorXd& y, const std::vector<std::size_t>& series,
                             int lags);

}  // namespace solenoid
