#include "experiments/systems/actuator/identify/statistics.hpp"

#include "experiments/systems/actuator/identify/estimate.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include <Eigen/Dense>
#include <boost/math/distributions/students_t.hpp>
#include <unsupported/Eigen/LevenbergMarquardt>

namespace solenoid {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The problem in x / scale, as Eigen's minimiser wants it.
struct Scaled : Eigen::DenseFunctor<double> {
  explicit Scaled(const LeastSquares& p, Index values)
      : DenseFunctor<double>(static_cast<int>(p.start.size()), static_cast<int>(values)), problem(p) {}

  int operator()(const VectorXd& z, VectorXd& r) const {
    problem.residuals(z.cwiseProduct(problem.scale), r);
    return r.allFinite() ? 0 : -1;
  }
  /// One-sided differences lead the search; its end is judged by central ones.
  int df(const VectorXd& z, MatrixXd& jacobian) const {
    VectorXd moved = z, here(values()), ahead(values());
    operator()(z, here);
    for (Index i = 0; i < z.size(); ++i) {
      moved[i] = z[i] + problem.step;
      operator()(moved, ahead);
      moved[i] = z[i];
      jacobian.col(i) = (ahead - here) / problem.step;
    }
    return 0;
  }
  void central(const VectorXd& z, MatrixXd& jacobian) const {
    VectorXd moved = z, ahead(values()), behind(values());
    for (Index i = 0; i < z.size(); ++i) {
      moved[i] = z[i] + problem.step;
      operator()(moved, ahead);
      moved[i] = z[i] - problem.step;
      operator()(moved, behind);
      moved[i] = z[i];
      jacobian.col(i) = (ahead - behind) / (2 * problem.step);
    }
  }
  const LeastSquares& problem;
};

/// sum_t g_t g_t' and its neighbours up to `lags` in one series of rows.
void add_scores(const MatrixXd& scores, Index first, Index count, int lags, MatrixXd& sum) {
  const auto block = scores.middleRows(first, count);
  sum += block.transpose() * block;
  for (Index lag = 1; lag <= std::min<Index>(lags, count - 1); ++lag) {
    const double weight = 1.0 - static_cast<double>(lag) / (lags + 1);
    const MatrixXd cross = block.topRows(count - lag).transpose() * block.bottomRows(count - lag);
    sum += weight * (cross + cross.transpose());
  }
}

/// Covariance and degrees of freedom of estimates with Jacobian `jacobian` of the residuals `fit.residuals`.
void judge(const MatrixXd& jacobian, const std::vector<std::size_t>& series, int lags, LeastSquaresFit& fit) {
  const Index n = jacobian.rows(), p = jacobian.cols();
  const MatrixXd inverse = (jacobian.transpose() * jacobian).ldlt().solve(MatrixXd::Identity(p, p));
  const MatrixXd scores = fit.residuals.asDiagonal() * jacobian;
  MatrixXd sum = MatrixXd::Zero(p, p);
  Index first = 0;
  for (const std::size_t length : series) {
    add_scores(scores, first, static_cast<Index>(length), lags, sum);
    first += static_cast<Index>(length);
  }
  const double small_sample = static_cast<double>(n) / static_cast<double>(std::max<Index>(1, n - p));
  fit.covariance = small_sample * (inverse * sum * inverse);
  fit.freedom = newey_west_freedom(static_cast<std::size_t>(n), lags) - static_cast<double>(p);
  fit.rms = std::sqrt(fit.residuals.squaredNorm() / static_cast<double>(n));
}

}  // namespace

double student_quantile(double freedom, double confidence) {
  const boost::math::students_t t(std::max(1.0, freedom));
  return boost::math::quantile(t, 0.5 + confidence / 2);
}

double mean_of(std::span<const double> x) {
  return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

double deviation_of(std::span<const double> x) {
  const double mean = mean_of(x);
  double sum = 0;
  for (const double v : x) sum += (v - mean) * (v - mean);
  return std::sqrt(sum / static_cast<double>(x.size() - 1));
}

double variance_of_mean(std::span<const double> x, int lags) {
  const double mean = mean_of(x);
  const auto n = x.size();
  double sum = 0;
  for (std::size_t lag = 0; lag <= static_cast<std::size_t>(lags) && lag < n; ++lag) {
    double gamma = 0;
    for (std::size_t t = 0; t + lag < n; ++t) gamma += (x[t] - mean) * (x[t + lag] - mean);
    sum += (lag == 0 ? 1.0 : 2.0 * (1.0 - static_cast<double>(lag) / (lags + 1))) * gamma;
  }
  const auto count = static_cast<double>(n);
  return sum / (count * count);
}

double newey_west_freedom(std::size_t n, int lags) {
  return lags == 0 ? static_cast<double>(n) : 1.5 * static_cast<double>(n) / (lags + 1);
}

double LeastSquaresFit::sigma(int i) const { return std::sqrt(covariance(i, i)); }

LeastSquaresFit solve_least_squares(const LeastSquares& problem) {
  const auto values = static_cast<Index>(std::accumulate(problem.series.begin(), problem.series.end(), std::size_t{0}));
  Scaled scaled(problem, values);
  Eigen::LevenbergMarquardt<Scaled> minimiser(scaled);
  minimiser.setFtol(1e-7);
  minimiser.setXtol(1e-5);
  minimiser.setMaxfev(60);
  VectorXd z = problem.start.cwiseQuotient(problem.scale);
  const auto status = minimiser.minimize(z);
  LeastSquaresFit fit;
  fit.converged = status > 0 && status != Eigen::LevenbergMarquardtSpace::TooManyFunctionEvaluation;
  fit.x = z.cwiseProduct(problem.scale);
  fit.residuals.resize(values);
  problem.residuals(fit.x, fit.residuals);
  MatrixXd jacobian(values, z.size());
  scaled.central(z, jacobian);
  judge(jacobian, problem.series, problem.lags, fit);
  fit.covariance = problem.scale.asDiagonal() * fit.covariance * problem.scale.asDiagonal();
  return fit;
}

LeastSquaresFit solve_linear(const MatrixXd& x, const VectorXd& y, const std::vector<std::size_t>& series, int lags) {
  LeastSquaresFit fit;
  fit.x = x.colPivHouseholderQr().solve(y);
  fit.residuals = y - x * fit.x;
  fit.converged = fit.x.allFinite();
  judge(x, series, lags, fit);
  return fit;
}

Estimate make_estimate(const std::string& name, const std::string& unit, double value, double sigma, double freedom,
                       const std::string& method) {
  const double reach = student_quantile(freedom) * sigma;
  return {name, unit, value, sigma, freedom, value - reach, value + reach, false, method};
}

void Findings::add(Findings other) {
  const auto take = [](auto& to, auto& from) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  };
  take(estimates, other.estimates);
  take(plots, other.plots);
  take(remarks, other.remarks);
}

const Estimate* Findings::find(const std::string& name) const {
  const auto at = std::ranges::find(estimates, name, &Estimate::name);
  return at == estimates.end() ? nullptr : &*at;
}

}  // namespace solenoid
