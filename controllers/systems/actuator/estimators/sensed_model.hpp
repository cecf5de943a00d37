#pragma once

#include "controllers/systems/actuator/estimators/loaded_actuator.hpp"
#include "controllers/systems/actuator/estimators/pressure_lag.hpp"
#include "controllers/systems/actuator/estimators/tuning.hpp"
#include "core/rt/controller.hpp"
#include "core/systems/actuator/signals.hpp"

#include <Eigen/Core>

namespace solenoid {

/// Mean and covariance of an estimate: the loaded actuator's eight states, then the lags of the two pressure channels.
struct Belief {
  static constexpr int core = 8, lag_a = core, lag_b = core + PressureLag::size, size = lag_b + PressureLag::size;
  using State = Eigen::Matrix<double, size, 1>;
  using Covariance = Eigen::Matrix<double, size, size>;  // symmetric: row- and column-major alike
  State mean = State::Zero();
  Covariance covariance = Covariance::Zero();
  bool at_rest = false;  ///< the last prediction ended at zero velocity
};

/// One tick of the model with its sensing chain, and its linearisation: what Kalman filter and moving horizon share.
class SensedModel {
 public:
  using Jacobian = Eigen::Matrix<double, Belief::core, Belief::core>;

  SensedModel(const PneumaticActuator& model, const EstimatorTuning& tuning);

  /// Moves `mean` by a tick under these inputs, by the model's own step. `at_rest` says whether the last tick left the
  /// velocity at zero, and receives it for this one: a slide at rest stays at rest under corrections of its velocity
  /// and moves off under forces alone.
  void advance(Belief::State& mean, bool& at_rest, const SwitchedOf<LoadedActuator>& opening,
               double motor_n) const noexcept;

  /// The Jacobian of the eight core states. Friction is linearised statistically where the velocity's sign is in doubt
  /// (its standard deviation is given), so that a slide at rest keeps a velocity the filter can still correct.
  /// `unknown_variance` receives what that leaves out, as a variance of the velocity after the tick.
  void linearise(const Belief::State& mean, double velocity_sigma, const SwitchedOf<LoadedActuator>& opening,
                 double motor_n, Jacobian& jacobian, double& unknown_variance) const noexcept;

  /// Multiplies a 24 x columns matrix (row-major) from the left with the tick's Jacobian, lags included.
  template <int columns>
  void propagate(const Jacobian& jacobian, double* rows) const noexcept {
    using Row = Eigen::Array<double, columns, 1>;
    const auto row = [rows](int i) { return Eigen::Map<Row>(rows + i * columns); };
    std::array<Row, Belief::core> next;
    for (int i = 0; i < Belief::core; ++i) {
      Row& sum = next[static_cast<std::size_t>(i)];
      sum = jacobian(i, i) * row(i);
      for (int j = 0; j < Belief::core; ++j)
        if (j != i && jacobian(i, j) != 0.0) sum += jacobian(i, j) * row(j);
    }
    const Row before_a = row(pressure_a), before_b = row(pressure_b);
    for (int i = 0; i < Belief::core; ++i) row(i) = next[static_cast<std::size_t>(i)];
    lag_.advance<columns>(rows + Belief::lag_a * columns, before_a.data(), rows + pressure_a * columns);
    lag_.advance<columns>(rows + Belief::lag_b * columns, before_b.data(), rows + pressure_b * columns);
  }

  /// Adds the process noise of a tick.
  void add_process_noise(double unknown_variance, Belief::Covariance& covariance) const noexcept;

  /// The measurement's row: sensor 0 position, 1 and 2 the pressures. `variance` receives its noise.
  const Belief::State& sensor(int index) const { return sensors_[static_cast<std::size_t>(index)]; }
  double expected(int index, const Belief::State& mean) const noexcept {
    return index == 0 ? mean[position] : sensor(index).dot(mean);
  }
  /// The sensor's row times a 24 x columns matrix (row-major): the columns' numbers in `out`.
  template <int columns>
  void sensor_row(int index, const double* rows, double* out) const noexcept {
    Eigen::Map<Eigen::Array<double, columns, 1>> sum(out);
    sum.setZero();
    const Belief::State& h = sensor(index);
    for (int i = 0; i < Belief::size; ++i)
      if (h[i] != 0.0) sum += h[i] * Eigen::Map<const Eigen::Array<double, columns, 1>>(rows + i * columns);
  }
  double sensor_variance(int index) const { return index == 0 ? position_variance_ : pressure_variance_; }

  /// Whether a sensor at the end of its range says no more than what is expected anyway.
  bool saturated(int index, double measured, double expected) const noexcept {
    const bool first = index == 0;
    const double margin = first ? tuning_.position_quantum_m : 100.0;
    const double low = first ? tuning_.position_low_m : tuning_.pressure_low_pa;
    const double high = first ? tuning_.position_high_m : tuning_.pressure_high_pa;
    return (measured > high - margin && expected > measured) || (measured < low + margin && expected < measured);
  }

  /// What is believed at a first measurement: at rest with settled filters, or anywhere.
  void start(const Measurement& sensors, bool at_rest, Belief& belief) const noexcept;
  /// Physical limits.
  void confine(Belief::State& mean) const noexcept;

  const LoadedActuator& model() const { return model_; }
  const EstimatorTuning& tuning() const { return tuning_; }

 private:
  LoadedActuator model_;
  EstimatorTuning tuning_;
  PressureLag lag_;
  std::array<Belief::State, 3> sensors_;
  Belief::State pressure_a_noise_, pressure_b_noise_, input_a_noise_, input_b_noise_;
  Eigen::Matrix<double, Belief::core, 1> core_noise_;
  double position_variance_, pressure_variance_;
};

}  // namespace solenoid
