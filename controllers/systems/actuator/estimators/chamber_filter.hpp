#pragma once

#include "controllers/systems/actuator/estimators/pressure_lag.hpp"
#include "core/systems/actuator/dynamics.hpp"

#include <Eigen/Core>

namespace solenoid {

/// What ValveHealth believes of the plant beyond the model, and how readily it calls a valve failed. The defaults were chosen on
/// plants of other seeds than those that docs/reference/reliability.md has figures of.
struct HealthTuning {
  double tick_s = 0.001;

  // Sensors.
  double filter_hz = 50.0;          ///< cut-off of the hardware Bessel filter
  double measured_sigma_pa = 60.0;  ///< noise after the filter, quantisation included
  double input_sigma_pa = 1000.0;   ///< noise and spikes before it, as white noise held for a tick
  double pressure_low_pa = 101325.0 - 210e3, pressure_high_pa = 101325.0 + 210e3;  ///< what the sensors can show
  double gate_sigmas = 4.0;  ///< innovations beyond this many standard deviations lose weight

  // The plant beyond the model.
  double flow_sigma = 0.1;                    ///< of the factors on supply and exhaust flow
  double flow_drift = 0.005;                  ///< [1/s^0.5]
  double least_flow = 0.65, most_flow = 1.3;  ///< bounds of these factors
  double delay_sigma = 0.15;                  ///< of the coils' relative lateness
  double supply_sigma_pa = 12e3;              ///< of the supply pressure
  double supply_memory_s = 0.5;               ///< within which it may change
  /// Of the chamber's walls [W/(m2 K)], some tens in small cylinders. 0: air stays at the supply's temperature, as the model has it.
  double heat_transfer = 50.0;
  double leak_sigma_pa_per_s = 20e3;  ///< of the pressure's rate that no flow explains (heat), memory leak_memory_s
  double leak_memory_s = 0.1;
  double white_pa = 60.0;     ///< of one tick
  double flow_white = 0.08;   ///< share of what flows in a tick
  double stroke_white = 0.1;  ///< share of what the slide's motion compresses in a tick

  // Decision.
  double leaking_share = 0.3;  ///< of the hypothesis that a valve leaks
  double late_s = 0.01;        ///< of the hypothesis that it is slow
  double clip = 9.0;           ///< squared innovations, in variances, count for at most so much
  double floor = -4.0;         ///< a hypothesis that fell so low begins anew
  double drift = 0.02;         ///< evidence that is lost each tick
  int copies = 2;              ///< of a hypothesis, begun at other moments
  int apart_ticks = 4;         ///< between their beginnings
  double change = 10.0;        ///< evidence that a fault becoming another of the chamber costs
  double beaten = 10.0;        ///< so far behind another fault of the chamber a hypothesis begins anew
  double memory_s = 1.0;       ///< evidence of ticks in which a hypothesis says the same as none fades
  double stuck_threshold = 17.0, other_threshold = 24.0;
  double doubt = 8.0;              ///< evidence from which a coil is suspected
  double margin = 8.0;             ///< over every other hypothesis, each measured from its own threshold
  double patience_s = 0.08;        ///< so long above the threshold, the best is taken whatever the margin
  double quiet_s = 0.15;           ///< no hypothesis for so long after what acted on the plant was not known
  double accused_memory_s = 0.05;  ///< within which evidence in both chambers counts as of one cause
  double worst_fit = 8.0;  ///< mean squared innovation, in variances, up to which a hypothesis explains the data
};

/// How wide the two paths of a chamber are open over a tick.
struct PathOpenings {
  double fill = 0.0, exhaust = 0.0;
  /// Openings that came into effect with this tick, times how many ticks after their command the model says they do (negative:
  /// closings): where the coils are late, this times their relative lateness did not.
  double fill_edges = 0.0, exhaust_edges = 0.0;
  bool operator==(const PathOpenings&) const = default;
};

/// An extended Kalman filter of the air in one chamber, seen through the pressure's Bessel filter, the stroke being known.
///                                                                                     [estimators.md, section 7]
///     x  = (P, z_1..z_8, f, e, l, P_s, w)   pressure, the filter's lag, factors of supply and exhaust flow, relative lateness of
///                                           the coils, supply pressure, a rate that nothing explains
///     P+ = P + dt (k R T/(A L) (f (s_f - l r_f) fill(P, P_s) + e (s_e - l r_e) T/T_s exhaust(P)) + q + w) - k P dL/L   (7.2)
///     q  = the walls' heat (7.3), T the air's temperature (7.4), T_s the supply's
///     z+ = PressureLag(P, P+),   z measured = lag's output + noise
///
/// The flow laws are the model's (4.23)-(4.27); within near_pa of the supply pressure the root is a line, so that a
/// chamber that is full still says what the supply pressure is. s and r are PathOpenings, L the chamber's length.
///
/// promise     no allocation, lock or exception
class ChamberFilter {
 public:
  static constexpr int fill_factor = 1 + PressureLag::size, exhaust_factor = fill_factor + 1,
                       lateness = fill_factor + 2, supply = fill_factor + 3, unexplained = fill_factor + 4,
                       size = fill_factor + 5;
  static constexpr double near_pa = 2e3, doubtful_pa = 25e3;

  /// What all filters of one chamber share.
  struct Chamber {
    Chamber(const PneumaticActuator& model, const HealthTuning& tuning, bool b);
    double length(double position_m) const { return b_ ? dead_m - position_m : dead_m + position_m; }
    double heating = 0.0;  ///< k R T/A
    double gas_constant = 287.0, wall_k = 293.0, area = 0.0, bore_m = 0.0;
    double ratio = 1.4, dead_m = 0.0, supply_pa = 0.0, atmosphere_pa = 0.0;
    double critical = 0.0, choked_per_pa = 0.0, fill_coefficient = 0.0;
    double discharge = 0.0, exhaust_choked_above_pa = 0.0, choked = 0.0;
    PressureLag lag;
    std::array<double, PressureLag::size> weights{}, held{};
    HealthTuning tuning;

   private:
    bool b_;
  };

  /// Says what it learnt of a tick.
  struct Innovation {
    double squared = 0.0;   ///< nu^2/S
    double variance = 1.0;  ///< S
  };

  /// At rest at this pressure.
  void start(const Chamber& chamber, double pressure_pa) noexcept;
  /// Moves the belief by a tick in which the chamber's length went from `from_m` to `to_m`.
  void predict(const Chamber& chamber, const PathOpenings& open, double from_m, double to_m) noexcept;
  /// Takes the tick's measured pressure.
  Innovation correct(const Chamber& chamber, double measured_pa) noexcept;

  /// Makes the pressure less certain, by a variance.
  void doubt_pressure(double variance_pa2) noexcept { covariance_(0, 0) += variance_pa2; }

  const Eigen::Matrix<double, size, 1>& mean() const { return mean_; }
  double temperature_k() const { return temperature_k_; }
  double sigma(int i) const { return std::sqrt(covariance_(i, i)); }
  /// What the pressure filter is expected to show, and its variance with the sensor's.
  double expected(const Chamber& chamber) const noexcept;

 private:
  using Covariance = Eigen::Matrix<double, size, size>;  // symmetric
  double heat_of_walls(const Chamber& chamber, double length_m) const noexcept;
  void follow_temperature(const Chamber& chamber, double growth, double mass_kg, double energy_j) noexcept;
  void propagate(const Chamber& chamber, const std::array<double, size>& pressure_row, double fade,
                 double supply_fade) noexcept;

  Eigen::Matrix<double, size, 1> mean_ = Eigen::Matrix<double, size, 1>::Zero();
  double temperature_k_ = 293.0;
  Covariance covariance_ = Covariance::Zero();
};

}  // namespace solenoid
