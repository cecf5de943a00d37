#pragma once

#include "solvers/qp/interior_point.hpp"
#include "solvers/qp/ocp_qp.hpp"
#include "solvers/qp/simd/riccati_kernels.hpp"

#include <cmath>

namespace solenoid::qp {

/// KKT back end for OcpQp: the Riccati recursion, barrier weights on the diagonals of R and Q.
///
/// layout   w: u_0 .. u_{N-1} packed (NU each, padded to whole vectors), x_1 .. x_N (XL lanes each);
///          y: N times XL; rows: the first `row_size` entries of w, all inputs and, where state_bounds, all states
template <int NX, int NU>
class RiccatiKkt {
 public:
  using Problem = OcpQp<NX, NU>;
  using Solution = OcpSolution<NX, NU>;

  void setup(const Problem& problem, const Settings& settings);
  /// Packs new numbers of the same horizon; false when the shape differs or a number is not finite.
  bool load(const Problem& problem) noexcept;

  int primal_size() const { return Workspace::padded(states_at_ + stages_ * XL); }
  int dual_size() const { return Workspace::padded(stages_ * XL); }
  int row_size() const { return state_bounds_ ? primal_size() : states_at_; }

  bool bounds(Rows& rows) const noexcept;
  /// Inputs decide the states, so bounds on all of them suffice.
  bool compact(const Rows& rows) const noexcept { return all_boxed(rows, stages_ * NU); }
  void start(double* w, double* y) noexcept;
  void row_values(const double* w, double* v) const noexcept { std::copy_n(w, row_size(), v); }
  Residual residual(const double* w, const double* y, const double* zeta, double* r_d, double* r_p) const noexcept {
    const StageResidual at = kernel_->residual(pack_, w, states_at_, y, zeta, state_bounds_, r_d, r_p);
    return {at.dual, at.primal, at.objective - constant_};
  }
  bool factor(const double* weight, const double* r_d, const double* r_p, const double* h) noexcept;
  void step(double* dw, double* dy, double* nu, int refinements) noexcept;
  static constexpr bool balanced_start = true;
  static constexpr bool primal_alone = true;
  /// A step leaves 1 - its length of the residuals; states' bounds take digits.
  bool exact_steps() const { return !state_bounds_; }
  static constexpr int least_refinements = 0;
  void adapt(double) noexcept {}  // what the inputs of a control problem cost bends them
  void stiffen() noexcept {
    constexpr double most = 1e-3;  // beyond this it would be another problem that is convex
    shift_ = std::max(shift_, std::min(std::max(100.0 * shift_, first_shift_), most));
  }
  /// Inputs are eliminated exactly; a held state would be a constraint across stages, beyond the recursion.
  bool can_hold(const signed char* side) const noexcept {
    return std::all_of(side + states_at_, side + std::max(states_at_, row_size()),
                       [](signed char s) { return s == 0; });
  }
  double row_violation(const Rows& rows, double seen) const noexcept {
    for (int i = states_at_; i < row_size(); ++i)
      if (rows.fixed[i] > 0.0) seen = std::max(seen, std::abs(rows.v[i] - rows.lower[i]));
    return seen;
  }
  void solve(const double* r_d, const double* r_p, const double* h, double* dw, double* dy, double* nu,
             int refinements) noexcept;
  void pin(double* w, const double* target, const double* weight) const noexcept {
    for (int i = 0; i < row_size(); ++i) w[i] = weight[i] > 0.0 ? target[i] : w[i];
  }
  Ray primal_ray(const double* y, const double* zeta, const Rows& rows) noexcept;
  Ray dual_ray(const double* w, const Rows& rows) noexcept;

  void unpack(const double* w, const double* y, const double* zeta, Solution& solution) const noexcept;
  void repack(const Solution& solution, double* w, double* y, double* zeta) const noexcept;

 private:
  static constexpr int W = portable::Riccati<NX, NU>::W, XL = portable::Riccati<NX, NU>::XL,
                       UL = portable::Riccati<NX, NU>::UL, H = NX + NU;

  void take(const double* r_d, const double* r_p, const double* h) noexcept;
  void adjoint(const double* g, const double* dw, double* dy) const noexcept;
  double least_curvature(const Problem& problem) const noexcept;
  void load_stage(const Problem& problem, int k) noexcept;
  template <int size>
  static auto piece(double* from) {
    return Eigen::Map<Eigen::Matrix<double, size, 1>>(from);
  }

  int stages_ = 0, states_at_ = 0;
  bool state_bounds_ = false;
  double constant_ = 0.0;  // the cost of x_0 alone
  double shift_ = 0.0, first_shift_ = 0.0;
  const RiccatiKernels* kernel_ = nullptr;
  const RowKernels* row_kernel_ = nullptr;
  const Problem* problem_ = nullptr;
  const double *weight_ = nullptr, *e_ = nullptr, *h_ = nullptr;  // of the latest factorisation and right-hand side
  StagePack pack_, homogeneous_, adjoint_;  // the problem; without its constants; without its cost
  RiccatiPack riccati_{};
  double *g_, *zeta_, *r_d_, *r_p_, *dw_, *dy_, *zero_;
  Workspace memory_;
};

}  // namespace solenoid::qp

#include "solvers/qp/riccati_kkt.ipp"
