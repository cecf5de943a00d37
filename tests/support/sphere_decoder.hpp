#pragma once

#include "core/systems/inverter/inverter.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <unsupported/Eigen/MatrixFunctions>

namespace solenoid::test {

/// Multistep direct MPC of a three-level inverter's load currents by sphere decoding: an opinion that shares nothing
/// with the project's model, rollout and searches but the parameters. The problem and the method are those of
/// T. Geyer, D. E. Quevedo, IEEE Trans. Power Electronics 29(12), 2014, by their abstract and the method's common form:
///
///     minimise   J = sum_{j=1..N} |i_ref[j] - i[j]|^2 + lambda sum_{j<N} |u[j] - u[j-1]|^2
///     over       u[j] in {-1, 0, 1}^3   subject to   |u[j] - u[j-1]|_inf <= 1
///
/// With the outputs Y = Gamma x + Upsilon U and the differences S U - E u[-1],
///
///     J = (U + W^-1 Theta)' W (U + W^-1 Theta) + const,   W = Upsilon' Upsilon + lambda S' S   (positive definite for
///     Theta = Upsilon' (Gamma x - Y_ref) - lambda S' E u[-1]                                    lambda > 0)
///
/// and with W = H' H, H lower triangular, the task is to find the point H U nearest to H U_unc, U_unc = -W^-1 Theta.
/// Row k of H asks only for the first k entries of U: depth first, at each depth the nearest level first (Schnorr,
/// Euchner), and back as soon as the squared distance so far exceeds that of the best point known.
class SphereDecoder {
 public:
  struct Answer {
    std::vector<std::array<int, 3>> levels;  ///< u[0] to u[N-1]
    double cost = 0.0;                       ///< J, summed step by step
    long nodes = 0;
  };

  SphereDecoder(const InverterParameters& p, double dt, int horizon, double lambda) : n_(horizon), lambda_(lambda) {
    discretise(p, dt);
    const Eigen::Index outputs = 2 * n_, inputs = 3 * n_;
    gamma_.setZero(outputs, 4);
    upsilon_.setZero(outputs, inputs);
    Eigen::Matrix4d power = Eigen::Matrix4d::Identity();
    for (int j = 0; j < n_; ++j) {
      const Eigen::Matrix<double, 2, 3> response = (power * b_).topRows<2>();  // to an input j steps before
      for (int i = 0; i + j < n_; ++i) upsilon_.block<2, 3>(2 * (i + j), 3 * i) = response;
      power = a_ * power;
      gamma_.middleRows<2>(2 * j) = power.topRows<2>();
    }
    difference_.setIdentity(inputs, inputs);
    for (Eigen::Index i = 3; i < inputs; ++i) difference_(i, i - 3) = -1.0;
    w_ = upsilon_.transpose() * upsilon_ + lambda * difference_.transpose() * difference_;
    // W^-1 = L L' gives H = L^-1, lower triangular.
    const Eigen::MatrixXd l = Eigen::MatrixXd(w_.inverse()).llt().matrixL();
    h_ = l.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(inputs, inputs));
  }

  /// reference: i_ref[1] to i_ref[N]
  Answer solve(const Eigen::Vector4d& x, const std::array<int, 3>& before,
               const std::vector<Eigen::Vector2d>& reference) {
    Eigen::VectorXd error = gamma_ * x;
    for (int j = 0; j < n_; ++j) error.segment<2>(2 * j) -= reference[static_cast<std::size_t>(j)];
    Eigen::VectorXd theta = upsilon_.transpose() * error;
    for (int k = 0; k < 3; ++k) theta[k] -= lambda_ * before[static_cast<std::size_t>(k)];  // S' E u[-1]
    target_ = h_ * w_.llt().solve(-theta);
    before_ = before;
    trial_.assign(static_cast<std::size_t>(3 * n_), 0);
    radius_ = std::numeric_limits<double>::infinity();
    nodes_ = 0;
    descend(0, 0.0);
    Answer answer;
    for (std::size_t j = 0; j < static_cast<std::size_t>(n_); ++j)
      answer.levels.push_back({best_[3 * j], best_[3 * j + 1], best_[3 * j + 2]});
    answer.cost = cost(x, before, reference, answer.levels);
    answer.nodes = nodes_;
    return answer;
  }

  /// J of a sequence, by its definition.
  double cost(Eigen::Vector4d x, std::array<int, 3> before, const std::vector<Eigen::Vector2d>& reference,
              const std::vector<std::array<int, 3>>& levels) const {
    double sum = 0.0;
    for (std::size_t j = 0; j < levels.size(); ++j) {
      const Eigen::Vector3d u(levels[j][0], levels[j][1], levels[j][2]);
      sum += lambda_ * (u - Eigen::Vector3d(before[0], before[1], before[2])).squaredNorm();
      x = a_ * x + b_ * u;
      sum += (reference[j] - x.head<2>()).squaredNorm();
      before = levels[j];
    }
    return sum;
  }

 private:
  /// x' = F x + G u over dt by the exponential of [F G; 0 0].
  void discretise(const InverterParameters& p, double dt) {
    const double r = p.resistance_ohm, l = p.inductance_h, w = 8 * std::atan(1.0) * p.emf_frequency_hz;
    Eigen::Matrix<double, 7, 7> m = Eigen::Matrix<double, 7, 7>::Zero();
    m.topLeftCorner<4, 4>() << -r / l, 0, -1 / l, 0, 0, -r / l, 0, -1 / l, 0, 0, 0, -w, 0, 0, w, 0;
    Eigen::Matrix<double, 2, 3> clarke;
    clarke << 1, -0.5, -0.5, 0, std::sqrt(3.0) / 2, -std::sqrt(3.0) / 2;
    m.topRightCorner<4, 3>().topRows<2>() = p.dc_link_v / 2 / l * 2 / 3 * clarke;
    const Eigen::Matrix<double, 7, 7> exponential = (m * dt).exp();
    a_ = exponential.topLeftCorner<4, 4>();
    b_ = exponential.topRightCorner<4, 3>();
  }

  void descend(std::size_t depth, double distance) {
    if (depth == trial_.size()) {
      radius_ = distance;
      best_ = trial_;
      return;
    }
    const auto row = static_cast<Eigen::Index>(depth);
    double rest = target_[row];
    for (std::size_t i = 0; i < depth; ++i) rest -= h_(row, static_cast<Eigen::Index>(i)) * trial_[i];
    const int previous = depth < 3 ? before_[depth] : trial_[depth - 3];
    std::array<std::pair<double, int>, 3> children;
    std::size_t count = 0;
    for (int level = -1; level <= 1; ++level) {
      if (std::abs(level - previous) > 1) continue;
      const double off = rest - h_(row, row) * level;
      std::size_t at = count++;
      for (; at > 0 && distance + off * off < children[at - 1].first; --at) children[at] = children[at - 1];
      children[at] = {distance + off * off, level};
    }
    for (std::size_t c = 0; c < count; ++c) {
      if (children[c].first >= radius_) return;
      ++nodes_;
      trial_[depth] = children[c].second;
      descend(depth + 1, children[c].first);
    }
  }

  int n_;
  double lambda_;
  Eigen::Matrix4d a_;
  Eigen::Matrix<double, 4, 3> b_;
  Eigen::MatrixXd gamma_, upsilon_, difference_, w_, h_;
  Eigen::VectorXd target_;
  std::array<int, 3> before_{};
  std::vector<int> trial_, best_;
  double radius_ = 0.0;
  long nodes_ = 0;
};

}  // namespace solenoid::test
