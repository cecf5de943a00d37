#pragma once

#include "core/systems/actuator/parameters.hpp"
#include "experiments/systems/actuator/identify/estimate.hpp"
#include "experiments/systems/actuator/identify/record.hpp"

namespace solenoid {

/// The slide's force balance (4.1) to (4.15) as a regression, without differentiating what is noisy. Everything goes
/// through the same Gaussian G (25 ms), and everything but the pressures through the pressure channels' own filter B:
///
///     G (A_a P_a - A_b P_b - P_0 (A_a - A_b)) + B G F_m
///         = m_eq B G'' y + F_cf B G sign(v) + C_vf B G' y - W + (T/r) B G sin(y/r)
///
/// W is the block's weight, T the gravity torque of the arm, both in the vertical plane only. Samples within reach of a
/// slide at rest (|v| < 2 mm/s) are left out: friction there is whatever it needs to be.
struct SlideModel {
  bool mass = true, viscous = true;
  bool reversals = true;     ///< quick ones count; slow sweeps stick in theirs, always at the same positions
  double given_mass_kg = 0;  ///< where it is not fitted
  double given_viscous = 0;
};

/// Fits the free ones; estimates are named equivalent_mass_kg, coulomb_friction_n, viscous_friction, weight_n,
/// arm_torque_nm, each ending in `suffix`.
Findings estimate_slide(const std::vector<const Record*>& records, const ActuatorParameters& given,
                        double filter_delay_s, const SlideModel& model, const std::string& suffix = "");

/// The payload from the equivalent masses with and without it, (4.13):  (m_loaded - m) r^2 / L^2.
Estimate payload_from(const Estimate& unloaded, const Estimate& loaded, const ActuatorParameters& given);

}  // namespace solenoid
