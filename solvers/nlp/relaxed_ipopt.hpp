#pragma once

#include "solvers/nlp/nlp.hpp"
#include "solvers/relaxed/transcription.hpp"

#include <unsupported/Eigen/AutoDiff>

namespace solenoid {

/// Ipopt on the multiple-shooting transcription with exact first and second derivatives: the reference for the
/// real-time solver, and for offline use. Not real time; see nlp.hpp.
///
///     z = (w_0 .. w_{N-1}, x_1 .. x_N),  states in units of HasStateScale, the cost in its own scale
///
/// Each stage is one function of zeta_k = (x_k, v_{k-1}, v_k, u_k); its Jacobian comes by AutoDiff, the Hessian of its
/// share of the Lagrangian by nested AutoDiff.                                       [theory-relaxed.md, sect. 5]
/// result   the better, by the exact physics, of Ipopt's point and the warm start
template <HybridModel M, int P, int A>
class RelaxedIpopt final : public RelaxedSolver<M>, private nlp::Program {
 public:
  /// Solves from `starts` points, the warm start and then one mode held throughout after another, and keeps the best.
  explicit RelaxedIpopt(const nlp::IpoptSettings& settings = {}, int starts = 1)
      : settings_(settings), starts_(starts) {}

  void prepare(const Problem<M>& problem, const RelaxedGrid& grid) override;
  SolveReport solve(const Problem<M>& problem, RelaxedPlan<M>& plan, Deadline deadline) noexcept override;

 private:
  using Trans = Transcription<M, P, A>;
  static constexpr int NX = Trans::NX, NU = Trans::NU, U = Trans::U, Z = NX + P + U;
  template <class S>
  using Zeta = std::array<S, static_cast<std::size_t>(Z)>;
  using First = Eigen::AutoDiffScalar<Eigen::Matrix<double, Z, 1>>;
  using Second = Eigen::AutoDiffScalar<Eigen::Matrix<First, Z, 1>>;

  double objective(std::span<const double> z) override;
  void gradient(std::span<const double> z, std::span<double> out) override;
  void constraints(std::span<const double> z, std::span<double> out) override;
  void jacobian_values(std::span<const double> z, std::span<double> out) override;
  void hessian_values(std::span<const double> z, double factor, std::span<const double> lambda,
                      std::span<double> out) override;

  /// Stage k: scaled cost, and the scaled state after it.
  template <class S>
  std::pair<S, Vector<S, M::state_size>> stage(std::size_t k, const Zeta<S>& zeta) const;
  /// Where entry i of zeta_k is in z; -1: a constant, the initial state or what was before the first interval.
  int place(int k, int i) const {
    const int n = static_cast<int>(t_.stages());
    if (i < NX) return k == 0 ? -1 : n * U + (k - 1) * NX + i;
    if (i < NX + P) return k == 0 ? -1 : (k - 1) * U + (i - NX);
    return k * U + (i - NX - P);
  }
  double entry(std::span<const double> z, int k, int i) const {
    const int at = place(k, i);
    if (at >= 0) return z[static_cast<std::size_t>(at)];
    const auto s = static_cast<std::size_t>(i);
    return i < NX ? problem_->initial[s] / t_.scale[s] : 0.0;
  }
  template <class S, class Seed>
  Zeta<S> seeded(std::span<const double> z, int k, const Seed& seed) const {
    Zeta<S> zeta;
    for (int i = 0; i < Z; ++i) zeta[static_cast<std::size_t>(i)] = seed(entry(z, k, i), i);
    return zeta;
  }
  Zeta<First> dual(std::span<const double> z, int k) const {
    return seeded<First>(z, k, [](double value, int i) { return First(value, Z, i); });
  }
  void set_patterns();
  void set_bounds();
  void hold(int mode);
  void load(const RelaxedPlan<M>& plan);

  nlp::IpoptSettings settings_;
  int starts_;
  Trans t_;
  const Problem<M>* problem_ = nullptr;
  double cost_scale_ = 1.0;
  std::vector<double> z_;
  RelaxedPlan<M> candidate_;
};

}  // namespace solenoid

#include "solvers/nlp/relaxed_ipopt.ipp"
