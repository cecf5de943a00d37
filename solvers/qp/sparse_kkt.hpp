#pragma once

#include "solvers/qp/interior_point.hpp"
#include "solvers/qp/sparse_qp.hpp"

#include <vector>

namespace solenoid::qp {

/// KKT back end for SparseQp: L D L' of the permuted quasi-definite matrix, on SuiteSparse's AMD and LDL.
///
///     | P + D_box + shift   A'       G'        |
///     | A                   -shift             |         positive and negative pivots in any symmetric order
///     | G                            -1 / D_g  |         [Vanderbei 1995; theory-qp.md, eq. 7]
///
/// The order and the pattern of L are found once, in setup; numbers are refactorised into them. Badly scaled rows and
/// columns are equilibrated (Ruiz), without touching products of slack and multiplier.
///
/// layout   w: n; y: p; rows: the n boxes, then, from a whole vector on, the m rows of G
class SparseKkt {
 public:
  static constexpr bool balanced_start = false, primal_alone = false;
  static constexpr bool exact_steps() { return false; }  // shifts take their share of every step
  static constexpr int least_refinements = 1;

  void setup(const SparseQp& problem, const Settings& settings);
  /// Takes new numbers of the same pattern; false when the shape differs or a number is not finite.
  bool load(const SparseQp& problem) noexcept;

  int primal_size() const { return Workspace::padded(n_); }
  int dual_size() const { return Workspace::padded(p_); }
  int row_size() const { return primal_size() + Workspace::padded(m_); }
  int factor_entries() const { return static_cast<int>(l_values_.size()); }

  void adapt(double stationarity) noexcept;
  void stiffen() noexcept;
  bool can_hold(const signed char*) const noexcept { return true; }
  bool bounds(Rows& rows) const noexcept;
  bool compact(const Rows& rows) const noexcept { return all_boxed(rows, n_); }
  void start(double* w, double* y) noexcept;
  void row_values(const double* w, double* v) const noexcept;
  double row_violation(const Rows& rows, double seen) const noexcept;
  Residual residual(const double* w, const double* y, const double* zeta, double* r_d, double* r_p) const noexcept;
  bool factor(const double* weight, const double* r_d, const double* r_p, const double* h) noexcept;
  void step(double* dw, double* dy, double* nu, int refinements) noexcept {
    solve(r_d_, r_p_, h_, dw, dy, nu, refinements);
  }
  void solve(const double* r_d, const double* r_p, const double* h, double* dw, double* dy, double* nu,
             int refinements) noexcept;
  void pin(double* w, const double* target, const double* weight) const noexcept;
  Ray primal_ray(const double* y, const double* zeta, const Rows& rows) noexcept;
  Ray dual_ray(const double* w, const Rows& rows) noexcept;

  void unpack(const double* w, const double* y, const double* zeta, SparseSolution& solution) const noexcept;
  void repack(const SparseSolution& solution, double* w, double* y, double* zeta) const noexcept;

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  /// Compressed columns with a slot in the KKT matrix for each entry.
  struct Block {
    std::vector<int> start, row, slot;
    std::vector<double> value;
    void copy_pattern(const SparseQp::Matrix& matrix, bool upper_only);
    bool load(const SparseQp::Matrix& matrix, bool upper_only) noexcept;
    void multiply(const double* x, double* out) const noexcept;             // out += M x
    void multiply_transposed(const double* x, double* out) const noexcept;  // out += M'x
  };

  void assemble_pattern();
  std::vector<int> best_order(const std::vector<int>& start, const std::vector<int>& row) const;
  void place(const std::vector<int>& order);
  void equilibrate() noexcept;
  void scatter() noexcept;
  void multiply_hessian(const double* w, double* out) const noexcept;
  double defect(const double* r_d, const double* r_p, const double* h, const double* dw, const double* dy) noexcept;
  void solve_once(double* top, double* middle, double* bottom) noexcept;

  int n_ = 0, p_ = 0, m_ = 0;
  double primal_shift_ = 0.0, dual_shift_ = 0.0, first_primal_shift_ = 0.0, first_dual_shift_ = 0.0;
  const SparseQp* problem_ = nullptr;
  const double *weight_ = nullptr, *r_d_ = nullptr, *r_p_ = nullptr, *h_ = nullptr;
  Block hessian_, equality_, inequality_;
  std::vector<double> c_, b_;
  std::vector<double> column_scale_, equality_scale_, row_scale_;
  bool scaled_ = false;

  // The permuted upper triangle and its factor.
  std::vector<int> inverse_, diagonal_;  // place of an unknown; slot of its diagonal
  std::vector<int> start_, row_, l_start_, parent_, count_, flag_, pattern_, l_row_;
  std::vector<double> values_, base_, l_values_, pivot_, inverse_pivot_, work_, rhs_;
  std::vector<double> top_, middle_, bottom_, nu_g_, correction_;
  std::vector<double> step_top_, step_middle_, step_bottom_;  // of a refinement
};

}  // namespace solenoid::qp
