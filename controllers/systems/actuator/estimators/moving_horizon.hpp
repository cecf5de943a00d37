#pragma once

#include "controllers/systems/actuator/estimators/kalman.hpp"

#include <vector>

#include <Eigen/Core>

namespace solenoid {

/// Moving-horizon estimator: the most likely trajectory through the last N ticks.          [estimators.md, section 3]
///
///     minimise   |xi|^2 + |w|^2 + sum_k sum_i rho((z_i[k] - h_i x[k]) / sigma_i)
///     over       xi: 24, w: 3 blocks x (force, drift of Pa, drift of Pb), all whitened
///     subject to x[0] = mean + L xi, L L' the covariance of the Kalman filter N ticks ago;  x[k+1] = model(x[k], w)
///
/// by Gauss-Newton on the model's own step and its forward-mode sensitivities, `iterations` steps from xi = w = 0, each
/// halved while it does not descend. rho is Huber's: spikes pull with a bounded force. The filter behind the arrival
/// cost runs alongside and never sees a measurement of the window twice.
///
/// shapes     window 20 to 50 ticks, 33 unknowns
/// promise    no allocation, lock or exception after construction
class MovingHorizon {
 public:
  MovingHorizon(const PneumaticActuator& model, const EstimatorTuning& tuning);

  ActuatorState update(const Measurement& sensors) noexcept;
  void applied(const SwitchedOf<PneumaticActuator>& opening, double motor_n) noexcept;
  EstimateDetail detail() const noexcept { return estimate_detail(belief_, kalman_.innovation()); }

  /// Cost of the last window at the arrival mean and at the estimate.
  double cost_at_arrival() const { return cost_at_arrival_; }
  double cost() const { return cost_; }

 private:
  static constexpr int blocks = 3, kinds = 3, unknowns = Belief::size + blocks * kinds;
  using Unknowns = Eigen::Matrix<double, unknowns, 1>;
  using Sensitivity = Eigen::Matrix<double, Belief::size, unknowns, Eigen::RowMajor>;
  using Normal = Eigen::Matrix<double, unknowns, unknowns>;

  struct Tick {
    Measurement sensors;
    SwitchedOf<PneumaticActuator> opening{};  // in effect from this tick on
    double motor_n = 0.0;
    Belief belief;  // of the Kalman filter after this tick's sensors
  };

  void remember(const Measurement& sensors) noexcept;
  void estimate() noexcept;
  const Tick& tick(int age) const noexcept;
  /// Adds block noise to the state before a tick; the same for a sensitivity's columns.
  void disturb(int k, const Unknowns& z, Belief::State& x) const noexcept;
  void disturb(int k, Sensitivity& s) const noexcept;
  /// Rolls the window from z; returns its cost and leaves the end in `end`.
  double roll(const Unknowns& z, Belief::State& end) const noexcept;
  /// The same, and gradient and Gauss-Newton matrix of the cost at z.
  void linearise(const Unknowns& z) noexcept;
  void weigh(const Tick& at, const Belief::State& x) noexcept;
  double measurement_cost(const Tick& at, const Belief::State& x) const noexcept;
  double sigma(int sensor) const noexcept { return sensor == 0 ? position_sigma_m_ : pressure_sigma_pa_; }
  bool informative(int sensor, double measured, double expected) const noexcept;

  ActuatorKalman kalman_;
  std::vector<Tick> ring_;
  int newest_ = -1, filled_ = 0;
  std::int64_t starts_ = 0;
  double position_sigma_m_, pressure_sigma_pa_, force_step_n_ = 0.0, pressure_step_pa_ = 0.0;
  int span_ = 0, block_ticks_ = 1;
  double cost_ = 0.0, cost_at_arrival_ = 0.0;

  Belief belief_;
  Belief::State arrival_;
  Belief::Covariance root_;  // L
  Sensitivity sensitivity_;
  Normal normal_;
  Unknowns gradient_;
};

}  // namespace solenoid
