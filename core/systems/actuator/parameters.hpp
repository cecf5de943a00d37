#pragma once

#include "core/systems/actuator/servo_valve.hpp"

#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

class TableReader;

/// Plane of the arm's motion; gravity acts on the slide only in the vertical one.
enum class Plane { vertical, horizontal };

/// The parameters are everything that the dynamics need, in SI units. Field comments name the source (thesis equation,
/// table or section). The defaults are the parameter set `consistent`.
struct ActuatorParameters {
  // Cylinder: Table 3-1, 4.5.1. Chamber A pushes towards +y, chamber B holds the rod.
  double bore_diameter_m = 0.02413;
  double rod_diameter_m = 0.00635;
  double dead_length_a_m = 0.008;   ///< y_a0: chamber A's length at y = 0 (4.19)
  double dead_length_b_m = 0.122;   ///< y_b0: chamber B's length at y = 0 (4.20)
  double end_clearance_m = 0.0015;  ///< chamber length left at either end stop: stroke 127 mm of 130 mm

  // Slide, arm, gear and motor: 3.3.1, Tables 3-2 and 3-3.
  double block_mass_kg = 1.17;
  double arm_mass_kg = 0.5;
  double arm_length_m = 0.35;
  double gear_pitch_diameter_m = 0.075;
  double pinion_pitch_diameter_m = 0.015;
  double motor_torque_constant = 0.060;  ///< K_t [N m/A]
  double amplifier_gain = 0.2;           ///< K_amp [A/V]
  double amplifier_limit_v = 5.0;
  double payload_mass_kg = 0.0;
  double gravity = 9.81;  ///< [m/s2]
  Plane plane = Plane::vertical;

  // Friction: section 4.4.
  double static_friction_n = 1.4;
  double coulomb_friction_n = 0.97;
  double viscous_friction = 4.5;  ///< C_vf [N s/m]

  // Air and valves: 3.3.2, 4.5.2, 4.5.3. Units of the two coefficients as corrected (model.md, E1).
  double atmospheric_pressure_pa = 101325.0;
  double supply_pressure_pa = 101325.0 + 150000.0;
  double heat_capacity_ratio = 1.4;
  double gas_constant = 287.0;  ///< [J/(kg K)]
  double temperature_k = 293.0;
  double fill_coefficient = 1.5e-6;       ///< c_fill [kg/(s Pa^0.5)], (4.26)
  double discharge_coefficient = 6.3e-9;  ///< c_dis [kg/(s Pa)], (4.27)
  double choked_flow = 0.00061;           ///< mdot_choked [kg/s]: 0.00061 `consistent`, 0.0061 `printed` (E2)
  double critical_pressure_ratio = 0.53;  ///< (4.23)
  double energise_delay_s = 0.004;
  double deenergise_delay_s = 0.001;
  ServoValve servo;  ///< of the configuration `servo`, a valve a chamber

  // Named choices over disputed prints.
  bool rod_atmosphere = true;  ///< P_0 on the rod's area in the cylinder force (E9)
  /// Equivalent mass without payload and arm gravity torque in place of the printed ones (E8, set `inferred`).
  std::optional<double> inferred_equivalent_mass_kg;
  std::optional<double> inferred_arm_torque_nm;

  // Derived quantities.
  double piston_area_a() const { return std::numbers::pi / 4 * bore_diameter_m * bore_diameter_m; }
  double piston_area_b() const { return piston_area_a() - std::numbers::pi / 4 * rod_diameter_m * rod_diameter_m; }
  double position_min_m() const { return end_clearance_m - dead_length_a_m; }
  double position_max_m() const { return dead_length_b_m - end_clearance_m; }
  double gear_radius_m() const { return gear_pitch_diameter_m / 2; }
  double arm_inertia() const { return arm_mass_kg * arm_length_m * arm_length_m / 3; }      ///< (3.4) [kg m2]
  double payload_inertia() const { return payload_mass_kg * arm_length_m * arm_length_m; }  ///< (3.5)
  double equivalent_mass_kg() const;                                                        ///< (4.13)
  /// Gravity torque of arm and payload at a horizontal arm, (4.5), (4.6) [N m].
  double gravity_torque_nm() const;
  /// F_grav = m_block g - torque sin(2 y/d_pitch)/(d_pitch/2), (4.8); 0 in the horizontal plane [N].
  double gravity_force_n(double position_m) const;
  double motor_force_limit_n() const {  ///< (4.10) at the amplifier's limit: 8.0 N
    return motor_torque_constant * amplifier_gain * amplifier_limit_v / (pinion_pitch_diameter_m / 2);
  }
  /// The hanging position where F_grav = 0 in the vertical plane: 19.70 mm as printed, without payload.
  /// Throws ConfigError if the arm cannot carry the block.
  double equilibrium_position_m() const;

  /// Throws ConfigError naming the field and what is allowed.
  void validate(const std::string& where) const;
  bool operator==(const ActuatorParameters&) const = default;
};

/// Returns a parameter set by name: `+`-joined choices, the first of them `consistent` (default), `printed` (flow, E2)
/// or `inferred` (inertia, E8), further ones any of `inferred`, `no_rod_atmosphere` (E9). Example: "printed+inferred".
/// Throws std::invalid_argument naming what is allowed.
ActuatorParameters named_parameters(const std::string& name);

/// The sets that listings show, the default first.
const std::vector<std::string>& parameter_set_names();
/// Says what named_parameters accepts, for help texts and errors.
std::string named_parameters_help();

/// Overrides fields from a table whose keys are the field names; `base` names the set to start from.
ActuatorParameters read_parameters(TableReader& table);

/// A mismatch is a set of factors on a plant's parameters that the controller is not told. Unity changes nothing.
struct Mismatch {
  double friction = 1.0;  ///< static, Coulomb and viscous
  double flow = 1.0;      ///< c_fill, c_dis and the choked flow
  double supply = 1.0;    ///< gauge supply pressure
  double delay = 1.0;     ///< both valve delays, and the time of a servo valve's spool
  double inertia = 1.0;   ///< equivalent mass, gravity unchanged

  /// The plant's parameters, `p` being what the controller believes.
  ActuatorParameters applied_to(ActuatorParameters p) const;
  bool operator==(const Mismatch&) const = default;
};
/// Reads `{ friction = 1.5, ... }`; factors that are not named are 1.
Mismatch read_mismatch(TableReader& table);

}  // namespace solenoid
