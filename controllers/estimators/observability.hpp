#pragma once

#include "controllers/estimators/kalman_setup.hpp"

namespace solenoid {

/// What measurements y = C x of x+ = A x say of x in the long run.
///
/// The unobservable subspace is the largest one inside the kernel of C that A maps into itself. x is observable if there
/// is none, and detectable if A only shrinks what lies in it (Hautus' condition).
struct Observability {
  int states = 0;           ///< n
  int rank = 0;             ///< n less the dimension of the unobservable subspace
  double persisting = 0.0;  ///< spectral radius of A on that subspace, 0 without one

  bool observable() const { return rank == states; }
  /// An error dies out that takes less than 1e7 ticks to; slower ones count as staying.
  bool detectable() const { return persisting < 1.0 - 1e-7; }
};

/// The subspace by the staircase algorithm, with ranks by singular values: of (A - I)/dt, so that slow systems and fast
/// sampling look alike. States must be scaled to order 1. Singular values below 1e-9 of the largest count as none.
Observability observability(const Eigen::MatrixXd& a, const Eigen::MatrixXd& c, double dt);

/// ... of the states and disturbances of a filter, linearised at a point. Delays change nothing: a channel that is late
/// loses only what is gone within its delay. With integrating disturbances detectability is the condition of offset-free
/// tracking (Pannocchia and Rawlings 2003; Maeder, Borrelli and Morari 2009), in the notation of linearise_core()
///
///     (J, H) detectable   and   rank [J - I, dt B; H, G] = states + disturbances,
///
/// so that there cannot be more integrating disturbances than channels.
template <HybridModel M>
Observability observability(const M& model, const KalmanSetup<M>& setup, const StateOf<M>& state,
                            const SwitchedOf<M>& switched, const ContinuousOf<M>& continuous, double tick_s) {
  setup.check();
  CoreMatrix<M> f;
  linearise_core(model, setup, state, switched, continuous, tick_s, f);
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(f.rows());
  if constexpr (HasStateScale<M>) {
    const StateOf<M> states = model.state_scale();
    std::copy(states.begin(), states.end(), scale.data());
  }
  for (std::size_t i = 0; i < setup.disturbances.size(); ++i)
    if (setup.disturbances[i].sigma > 0) scale[int{M::state_size} + static_cast<int>(i)] = setup.disturbances[i].sigma;
  Eigen::MatrixXd c(setup.channels.size(), f.rows());
  for (std::size_t i = 0; i < setup.channels.size(); ++i) {
    const Eigen::VectorXd row = channel_row(setup, i).cwiseProduct(scale);
    c.row(static_cast<int>(i)) = row.transpose() / std::max(row.norm(), 1e-300);
  }
  return observability(scale.cwiseInverse().asDiagonal() * Eigen::MatrixXd(f) * scale.asDiagonal(), c, tick_s);
}

}  // namespace solenoid
