#pragma once

#include "core/mpc/deadline.hpp"
#include "solvers/qp/simd/kernel_table.hpp"
#include "solvers/qp/types.hpp"
#include "solvers/qp/workspace.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace solenoid::qp {

/// What a KKT back end reports of a point.
struct Residual {
  double dual = 0.0, primal = 0.0;  ///< largest entries of stationarity and of the equalities
  double objective = 0.0;
};

/// How far a ray is from proving infeasibility, after scaling its largest entry to 1.
struct Ray {
  double error = 0.0;  ///< largest violation of the certificate's equations and cones
  double value = 0.0;  ///< negative for a certificate
};

/// Primal-dual interior point for   minimise w'H w / 2 + c'w   s.t.  A w = b,  lower <= C w <= upper.
///
/// Mehrotra's predictor-corrector on the proximal KKT system
///
///     | H + C'D C + shift   A'        | | dw |     | r_d + C'h |
///     | A                   -shift    | | dy | = - | r_p       |                 [theory-qp.md, eq. 3 to 6]
///
/// finished, where the active set has settled, by the exact solution on that set. The back end `Kkt` owns the problem
/// and the factorisation; a call to it is work on the whole system, resolved at compile time:
///
///     int primal_size(), dual_size(), row_size()                   padded to whole vectors
///     bool bounds(Rows&)                                           false: a lower bound above its upper
///     void start(double* w, double* y)                             a cold start
///     void row_values(const double* w, double* v)                  v = C w
///     Residual residual(w, y, zeta, r_d, r_p)
///     bool factor(weight, r_d, r_p, h)                             for D, with a first right-hand side; false: not
///                                                                  quasi-definite
///     void step(dw, dy, nu, int refinements)                       its solution; nu = D C dw + h, or null; where
///                                                                  primal_alone, dy may be null without refinements
///     bool exact_steps()                                           a step leaves 1 - its length of the residuals
///     void adapt(double stationarity)                              shifts for a point this far from stationary
///     void stiffen()                                               greater shifts until the next load; adapt() may
///                                                                  take the primal one back
///     bool can_hold(const signed char* side)                       whether these rows may be held as equalities
///     void solve(r_d, r_p, h, dw, dy, nu, int refinements)         the same for another right-hand side
///     balanced_start                                               start() meets equalities and adjoints already
///     least_refinements                                            of a solve that must be exact
///     double row_violation(const Rows&, double seen)               largest row residual in the problem's own units
///     void pin(double* w, const double* target, const double* weight)      held boxes onto their bounds
///     bool compact(const Rows&)                                    the rows leave no direction unbounded: no dual ray
///     Ray primal_ray(y, zeta, rows), dual_ray(w, rows)
template <class Kkt>
class InteriorPoint {
 public:
  void setup(const Kkt& kkt, const Settings& settings);

  /// From w, y, zeta (warm) or anywhere (cold); leaves the solution or certificate in them.
  Info solve(Kkt& kkt, bool warm, Deadline deadline) noexcept;

  double *w = nullptr, *y = nullptr;
  Rows rows{};

 private:
  enum class Verdict : std::uint8_t { go_on, stop };

  Verdict start(Kkt& kkt, bool warm, Deadline deadline) noexcept;
  void start_inside(Kkt& kkt, bool warm) noexcept;
  void balance(Kkt& kkt) noexcept;
  void enter_interior(double product) noexcept;
  void evaluate(Kkt& kkt) noexcept;
  void follow_residuals() noexcept;
  void take_residuals(Kkt& kkt) noexcept;
  Verdict judge(Kkt& kkt, Deadline deadline) noexcept;
  bool converged() const noexcept;
  bool certified(Kkt& kkt) noexcept;
  bool factor(Kkt& kkt, const double* weight, const double* h) noexcept;
  double predict(Kkt& kkt) noexcept;
  void correct(Kkt& kkt, double target) noexcept;
  void advance(double length) noexcept;
  bool settled() noexcept;
  bool finish_on_active_set(Kkt& kkt, Deadline deadline) noexcept;
  bool solve_on_active_set(Kkt& kkt) noexcept;
  int revise_active_set() noexcept;
  bool accept_active_set(Kkt& kkt) noexcept;
  Verdict end(Status status) noexcept;

  static double step_length(double ratio, double fraction) { return ratio * 1.0 > fraction ? fraction / ratio : 1.0; }
  int few() const { return std::max(1, bounded_ / 12); }
  double mean(double product) const { return sides_ > 0 ? product / sides_ : 0.0; }

  /// Without the objective's share while that is an older point's.
  double allowed_gap() const {
    return settings_.gap_absolute + (stale_ ? 0.0 : settings_.gap_relative * std::abs(at_.objective));
  }

  Settings settings_;
  const RowKernels* kernel_ = nullptr;
  Workspace memory_;
  int primal_ = 0, dual_ = 0;
  int sides_ = 0;         // bounds present, lower and upper counted apart
  int bounded_ = 0;       // rows with a bound on either side
  int correctable_ = 1;   // rows that a step of the next attempt on an active set may correct
  int tried_wrong_ = 0;   // rows that the first step of the last attempt found wrong
  bool compact_ = false;  // the feasible set has no ray

  double *r_d_, *r_p_, *dw_, *dy_;
  // A guess of the active set: -1 at lower, 1 at upper, 0 free; the last one tried; and the point solved on it.
  std::vector<signed char> side_, guess_, tried_;
  double *as_w_, *as_y_, *as_v_, *as_zeta_, *as_weight_, *as_shift_, *as_rd_, *as_rp_, *as_target_;

  Info info_;
  Residual at_;
  RowState row_at_;
  double length_ = 0.0;        // of the last step
  bool follow_ = false;        // whether the residuals may be taken to be what the steps leave of them ...
  bool stale_ = false;         // ... and whether they were, so that the objective is an older point's
  double affine_ratio_ = 0.0;  // products after the longest affine step over those before
  int refinements_ = 0;
};

}  // namespace solenoid::qp

#include "solvers/qp/interior_point.ipp"
