#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace solenoid {

/// Where a sample is on the axis of one share of a function: a coordinate, and on which of several branches, which tell
/// nothing of each other.
struct GpCoordinate {
  double z = 0.0;
  int branch = 0;
};

/// Amplitude and length of a share's kernel, sigma^2 exp(-(z - z')^2 / (2 length^2)) on one branch and 0 across branches.
struct GpKernel {
  double sigma = 1.0, length = 1.0;
};

/// What is found from data beside the function itself.
struct GpHyper {
  std::vector<GpKernel> shares;
  double noise = 1.0;  ///< standard deviation of the white noise on each sample
};

/// Samples t_i = sum_c f_c(at_c,i) + sum_k linear_i,k w_k + noise.
struct GpData {
  std::vector<std::vector<GpCoordinate>> shares;  ///< of each share, of each sample
  Eigen::MatrixXd linear;  ///< samples x weights, each column times its weight's standard deviation; may have no column
  Eigen::VectorXd target;

  Eigen::Index size() const { return target.size(); }
  /// The samples of these indices.
  GpData part(const std::vector<std::size_t>& chosen) const;
};

/// Mean and variance of what is believed.
struct GpValue {
  double mean = 0.0, variance = 0.0;
};

/// Regression by an additive Gaussian process with linear terms of Gaussian weights: C. E. Rasmussen, C. K. I. Williams,
/// Gaussian Processes for Machine Learning, MIT Press 2006, algorithm 2.1 and section 2.7.
///
///     K = sum_c k_c + linear linear' + noise^2 I = L L',   alpha = K^-1 t
///     f_c(z): mean k_c(z)' alpha, variance k_c(z, z) - |L^-1 k_c(z)|^2
///     log p(t) = -t' alpha / 2 - sum log L_ii - n/2 log 2 pi
///
/// Costs n^3/3 operations and n^2 numbers.
class GaussianProcess {
 public:
  /// Throws std::invalid_argument for shapes that do not fit, or a K that is not positive definite.
  GaussianProcess(GpData data, GpHyper hyper);

  double log_likelihood() const { return log_likelihood_; }
  /// Of one share at a place.
  GpValue share(std::size_t c, const GpCoordinate& at) const;
  /// Of a sample i of other data: its shares, linear terms and noise together.
  GpValue predicted(const GpData& other, Eigen::Index i) const;
  /// Of the weight of a linear column, in its standard deviation.
  GpValue weight(Eigen::Index k) const;

 private:
  GpValue posterior(const Eigen::VectorXd& covariance, double prior) const;

  GpData data_;
  GpHyper hyper_;
  Eigen::MatrixXd factor_;  // L, lower
  Eigen::VectorXd alpha_;
  double log_likelihood_ = 0.0;
};

/// Hyperparameters of greatest likelihood by a compass search over their logarithms from `start`: each in turn is tried
/// up and down, the step halves from a factor of 2 to one of 1.05. Deterministic; a local optimum. Amplitudes and noise
/// stay in [1e-3, 1e3] of the start's, lengths in [1/8, 8].
GpHyper most_likely(const GpData& data, const GpHyper& start);

}  // namespace solenoid
