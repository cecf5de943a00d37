#pragma once

#include "experiments/systems/actuator/sizing/sizing.hpp"

#include <span>
#include <string>
#include <vector>

namespace solenoid {

/// A change of one assumption that the study's answer is tried under.
struct RatioChange {
  std::string name, key;
  double factor = 1.0;
};

/// What the study takes for granted: keys, units and sources in tasks/force_ratio.toml.
struct RatioAssumptions {
  double reserve = 1.0, safety_factor = 1.0;
  std::vector<double> modules_m;
  double limit_switches_per_s = 0.0, limit_air_g = 0.0;
  double cylinder_bore_mm = 1.0, cylinder_mass_kg = 0.0, cylinder_mass_exponent = 0.0, cylinder_price = 0.0,
         cylinder_price_exponent = 0.0;
  double air_mass_kg = 0.0, air_price = 0.0, compressor_efficiency = 1.0;
  double motor_torque_nm = 1.0, motor_mass_kg = 1.0, motor_mass_exponent = 0.0, motor_price = 0.0,
         motor_price_exponent = 0.0, motor_constant = 1.0, motor_inertia = 0.0;
  double amplifier_mass_kg = 0.0, amplifier_mass_exponent = 0.0, amplifier_price = 0.0, amplifier_price_exponent = 0.0;
  double weight_error = 0.0, weight_energy = 0.0, weight_mass = 0.0, weight_price = 0.0;
  std::vector<RatioChange> changes;

  /// The same with one number changed. Throws std::invalid_argument for a key there is not.
  RatioAssumptions with(const RatioChange& change) const;
};
/// The shipped ones, or those with what a file says else. Throws ConfigError with file, line, key and what is allowed.
const RatioAssumptions& shipped_ratio_assumptions();
RatioAssumptions read_ratio_assumptions(const std::string& path);

/// Cylinder and motor of one ratio. Capability is the sum of their largest forces, the same at every ratio:
///
///     capability = reserve F_c (3.11),   cylinder (1 - share) capability,   motor share capability
///     bore by (3.13);   motor torque F d_pinion/2;   pinion of the least module whose tooth (A.7, standard) is safe
struct RatioDesign {
  double share = 0.0;  ///< the motor's, 0: cylinder only, 1: motor only
  double cylinder_n = 0.0, motor_n = 0.0;
  double bore_m = 0.0;
  double module_m = 0.0, pinion_m = 0.0, pinion_safety = 0.0;
  double motor_torque_nm = 0.0, motor_inertia = 0.0, motor_constant = 0.0;
  double mass_kg = 0.0, price = 0.0;

  bool has_cylinder() const { return share < 1.0; }
  bool has_motor() const { return share > 0.0; }
};
/// Throws ConfigError where no module is strong enough.
RatioDesign design_ratio(double share, const SizingTask& task, const RatioAssumptions& assumptions);

/// What was measured at a ratio, over the judging plants. Energies per run:
///     copper    integral of (F r_pinion/K_m)^2 dt = force_square_ns r_pinion^2/K_m^2
///     motoring  integral of max(F v, 0) dt: what brakes is not recovered
struct RatioMeasured {
  double rmse_mm = 0.0, rmse_margin = 1.0, worst_rmse_mm = 0.0;
  double switches_per_s = 0.0, air_g = 0.0, motor_rms_n = 0.0;
  double force_square_ns = 0.0;  ///< mean over runs of the integral of F^2 dt [N2 s]
  double motoring_j = 0.0;
  int runs = 0, bad = 0;
};

/// The criteria of a ratio under some assumptions.
struct RatioCriteria {
  double error_mm = 0.0, electric_j = 0.0, air_j = 0.0, mass_kg = 0.0, price = 0.0;
  double score = 0.0;  ///< weighted sum of logarithms; the least is recommended
  double energy_j() const { return electric_j + air_j; }
};
RatioCriteria criteria_of(const RatioDesign& design, const RatioMeasured& measured, const SizingTask& task,
                          const RatioAssumptions& assumptions);

/// The position of the least score; ratios where a run ended badly do not stand. -1: none does.
int recommended(std::span<const RatioCriteria> criteria, std::span<const RatioMeasured> measured);
/// Whether no other is at least as good in error, energy, mass and price and better in one.
std::vector<bool> efficient(std::span<const RatioCriteria> criteria);

}  // namespace solenoid
