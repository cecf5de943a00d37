#include "experiments/systems/actuator/identify/gaussian_process.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <Eigen/Cholesky>

namespace solenoid {
namespace {

double covariance(const GpKernel& kernel, const GpCoordinate& a, const GpCoordinate& b) {
  if (a.branch != b.branch) return 0.0;
  const double apart = (a.z - b.z) / kernel.length;
  return kernel.sigma * kernel.sigma * std::exp(-apart * apart / 2);
}

void check_shapes(const GpData& data, const GpHyper& hyper) {
  const auto n = static_cast<std::size_t>(data.size());
  bool fit = n > 0 && data.shares.size() == hyper.shares.size() && data.linear.rows() == data.size();
  for (const auto& share : data.shares) fit = fit && share.size() == n;
  if (!fit) throw std::invalid_argument("Gaussian process: samples, shares and linear terms do not fit");
}

/// One of the hyperparameters, by number: amplitude and length of each share, then the noise.
double& parameter(GpHyper& hyper, std::size_t k) {
  if (k == 2 * hyper.shares.size()) return hyper.noise;
  GpKernel& kernel = hyper.shares[k / 2];
  return k % 2 ? kernel.length : kernel.sigma;
}

double likelihood_of(const GpData& data, const GpHyper& hyper) {
  try {
    return GaussianProcess(data, hyper).log_likelihood();
  } catch (const std::invalid_argument&) {
    return -std::numeric_limits<double>::infinity();
  }
}

}  // namespace

GpData GpData::part(const std::vector<std::size_t>& chosen) const {
  GpData some;
  const auto n = static_cast<Eigen::Index>(chosen.size());
  some.target.resize(n);
  some.linear.resize(n, linear.cols());
  some.shares.resize(shares.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t from = chosen[static_cast<std::size_t>(i)];
    some.target[i] = target[static_cast<Eigen::Index>(from)];
    some.linear.row(i) = linear.row(static_cast<Eigen::Index>(from));
    for (std::size_t c = 0; c < shares.size(); ++c) some.shares[c].push_back(shares[c][from]);
  }
  return some;
}

GaussianProcess::GaussianProcess(GpData data, GpHyper hyper) : data_(std::move(data)), hyper_(std::move(hyper)) {
  check_shapes(data_, hyper_);
  const Eigen::Index n = data_.size();
  Eigen::MatrixXd k = data_.linear * data_.linear.transpose();
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index i = j; i < n; ++i)
      for (std::size_t c = 0; c < hyper_.shares.size(); ++c)
        k(i, j) += covariance(hyper_.shares[c], data_.shares[c][static_cast<std::size_t>(i)],
                              data_.shares[c][static_cast<std::size_t>(j)]);
  k.diagonal().array() += hyper_.noise * hyper_.noise;
  const Eigen::LLT<Eigen::MatrixXd> cholesky(k);
  if (cholesky.info() != Eigen::Success)
    throw std::invalid_argument("Gaussian process: the covariance is not positive definite");
  factor_ = cholesky.matrixL();
  alpha_ = cholesky.solve(data_.target);
  log_likelihood_ = -data_.target.dot(alpha_) / 2 - factor_.diagonal().array().log().sum() -
                    static_cast<double>(n) / 2 * std::log(2 * std::numbers::pi);
}

GpValue GaussianProcess::posterior(const Eigen::VectorXd& covariance, double prior) const {
  const Eigen::VectorXd explained = factor_.triangularView<Eigen::Lower>().solve(covariance);
  return {covariance.dot(alpha_), std::max(0.0, prior - explained.squaredNorm())};
}

GpValue GaussianProcess::share(std::size_t c, const GpCoordinate& at) const {
  const GpKernel& kernel = hyper_.shares.at(c);
  Eigen::VectorXd k(data_.size());
  for (Eigen::Index i = 0; i < k.size(); ++i)
    k[i] = covariance(kernel, data_.shares[c][static_cast<std::size_t>(i)], at);
  return posterior(k, kernel.sigma * kernel.sigma);
}

GpValue GaussianProcess::predicted(const GpData& other, Eigen::Index i) const {
  Eigen::VectorXd k = data_.linear * other.linear.row(i).transpose();
  double prior = other.linear.row(i).squaredNorm() + hyper_.noise * hyper_.noise;
  for (std::size_t c = 0; c < hyper_.shares.size(); ++c) {
    const GpCoordinate& at = other.shares[c][static_cast<std::size_t>(i)];
    prior += hyper_.shares[c].sigma * hyper_.shares[c].sigma;
    for (Eigen::Index j = 0; j < k.size(); ++j)
      k[j] += covariance(hyper_.shares[c], data_.shares[c][static_cast<std::size_t>(j)], at);
  }
  return posterior(k, prior);
}

GpValue GaussianProcess::weight(Eigen::Index k) const { return posterior(data_.linear.col(k), 1.0); }

GpHyper most_likely(const GpData& data, const GpHyper& start) {
  constexpr double first_step = 2.0, last_step = 1.05;
  GpHyper best = start;
  double highest = likelihood_of(data, best);
  for (double step = first_step; step >= last_step;) {
    bool better = false;
    for (std::size_t k = 0; k <= 2 * best.shares.size(); ++k)
      for (const double factor : {step, 1 / step}) {
        GpHyper tried = best, from = start;
        parameter(tried, k) *= factor;
        const bool length = k % 2 == 1;
        const double ratio = parameter(tried, k) / parameter(from, k), most = length ? 8.0 : 1e3;
        if (ratio > most || ratio < 1 / most) continue;
        const double likelihood = likelihood_of(data, tried);
        if (likelihood <= highest) continue;
        highest = likelihood;
        best = tried;
        better = true;
        break;
      }
    if (!better) step = std::sqrt(step);
  }
  return best;
}

}  // namespace solenoid
