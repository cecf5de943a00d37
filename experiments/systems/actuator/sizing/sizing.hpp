#pragma once

#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

inline constexpr double millimetre = 1e-3;

/// Chapter 3 and appendix A of the thesis as functions: from a motion of the arm to cylinder, motor and gear. SI units.

/// Desired motion of the arm over T_e, from rest to rest:
///   cycloidal   theta = theta_i + theta_total (s - sin(2 pi s)/(2 pi)), s = t/T_e                    (3.1), (3.2)
///   quintic     theta = theta_i + theta_total (10 s^3 - 15 s^4 + 6 s^5), the least jerk
///   cosine      theta = theta_i + theta_total (1 - cos(pi s))/2, half a period of a swing to and fro
enum class ArmMotionLaw { cycloidal, quintic, cosine };
struct ArmMotion {
  ArmMotionLaw law = ArmMotionLaw::cycloidal;
  double from_rad = 0.0;  ///< theta_i; 0 hangs straight down
  double total_rad = std::numbers::pi;
  double move_s = 4.0;  ///< T_e
};
struct ArmSample {
  double angle_rad = 0.0, speed_rad_s = 0.0, acceleration_rad_s2 = 0.0;
};
ArmSample arm_at(const ArmMotion& motion, double time_s);
/// Largest speed and acceleration, closed forms: cycloidal 2 theta_total/T_e and 2 pi theta_total/T_e^2 (3.3); quintic
/// 15/8 and 10/sqrt(3); cosine pi/2 and pi^2/2, of theta_total/T_e and theta_total/T_e^2.
double largest_speed(const ArmMotion& motion);
double largest_acceleration(const ArmMotion& motion);

/// What is to be moved and with what. The defaults are the thesis's, so are those of a task's file
/// (experiments/systems/actuator/data/tasks/sizing.toml).
struct SizingTask {
  std::string name = "thesis";
  bool vertical = true;
  double gravity = 9.8;  ///< the only value chapter 3 prints, in (3.11)
  double arm_mass_kg = 0.5, arm_length_m = 0.35, payload_kg = 0.5;
  ArmMotion motion;
  double slide_mass_kg = 1.17;       ///< its weight pushes towards +y
  double coulomb_friction_n = 0.97;  ///< 4.4; chapter 3 leaves friction out
  double viscous_friction = 4.5;     ///< [N s/m]
  double supply_gauge_pa = 150e3, rod_diameter_m = 0.00635, stroke_m = 0.127;
  std::optional<double> bore_m = 0.02413;  ///< of the cylinder that was bought, if one was
  std::vector<double> standard_bores_m;    ///< to choose from, rising
  double module_m = 0.75e-3, face_width_m = 3e-3, tooth_strength_pa = 239e6;
  int gear_teeth = 100, pinion_teeth = 20;
  double motor_share = 0.1;  ///< of the largest torque, Petrosky's heuristic

  double gear_diameter_m() const { return gear_teeth * module_m; }
  double pinion_diameter_m() const { return pinion_teeth * module_m; }
};

double arm_inertia(const SizingTask& task);      ///< m_arm L^2/3 (3.4) [kg m2]
double payload_inertia(const SizingTask& task);  ///< m_payload L^2 (3.5) [kg m2]

/// Torques about the arm's axis at one moment [N m]: (3.6), (3.8) and their sum (3.9); gravity 0 in a horizontal plane.
struct ArmTorque {
  double time_s = 0.0, angle_rad = 0.0, acceleration_nm = 0.0, gravity_nm = 0.0;
  double total_nm() const { return acceleration_nm + gravity_nm; }
};
ArmTorque torque_at(const SizingTask& task, double time_s);
/// The curve of figure 3-3, `points` of them evenly in time.
std::vector<ArmTorque> torque_curve(const SizingTask& task, int points);
/// Where the total torque is largest in magnitude, to a millionth of T_e.
ArmTorque torque_peak(const SizingTask& task);

double force_at_pitch(double torque_nm, double pitch_diameter_m);  ///< (3.10) [N]
/// (3.13) for a force of at least 0 [m]; rod: of a pulling cylinder, whose area is the ring around it.
double bore_for_force(double force_n, double gauge_pa, double rod_m = 0.0);
double force_of_bore(double bore_m, double gauge_pa, double rod_m = 0.0);  ///< (3.12) [N]
/// The least of `rising` that is not below; none: nothing there is large enough.
std::optional<double> next_standard(const std::vector<double>& rising, double least);
double motor_torque(double share, double torque_nm, double pinion_m, double gear_m);  ///< (3.15) [N m]

/// Y of the Lewis equation for teeth of 20 degrees, full depth: Shigley, table 14-2, linear in 1/N between its lines.
/// 12 teeth at least.
double lewis_form_factor(int teeth);
/// Barth's factor of cut or milled teeth, (6.1 + V)/6.1 with the pitch line's speed V in m/s. (A.6) puts rad/s there.
double barth_factor(double speed);
/// Lewis bending stress of a tooth, K_v F/(w m Y), (A.7) [Pa].
double tooth_stress(double load_factor, double force_n, double face_width_m, double module_m, double form_factor);

/// One reading of appendix A: its speed, what it takes for one, and what follows.
struct ToothReading {
  std::string name, speed_unit;
  double speed = 0.0, force_n = 0.0, load_factor = 1.0, stress_pa = 0.0, safety = 0.0;
};
ToothReading read_tooth(const SizingTask& task, std::string name, double speed, std::string speed_unit, double force_n,
                        int teeth);

/// Forces that chapter 3 leaves out: the slide's own inertia, friction both ways, and pulling on the way back.
struct CylinderForces {
  double push_n = 0.0, pull_n = 0.0;
};
CylinderForces full_cylinder_forces(const SizingTask& task);

/// Everything that (3.3) to (3.15) and (A.2) to (A.9) give for a task, each step from the one before it. Torque, force
/// and the cylinder's force have the sign of the peak; a cylinder that must pull works on the ring around its rod.
struct Sizing {
  double acceleration_rad_s2 = 0.0, arm_inertia = 0.0, payload_inertia = 0.0, acceleration_torque_nm = 0.0;
  ArmTorque peak;
  double torque_nm = 0.0, force_n = 0.0, cylinder_n = 0.0, bore_m = 0.0, motor_nm = 0.0;
  double speed_rad_s = 0.0, pitch_speed_m_s = 0.0;
  ToothReading gear;    ///< at the rack, the whole force, standard formula
  ToothReading pinion;  ///< the motor's share of the force
  CylinderForces full;
  double bore_full_m = 0.0;  ///< for the full forces, both ways
  std::optional<double> standard_bore_m, standard_bore_full_m;
  double stroke_m = 0.0;  ///< theta_total d_pitch/2
};
Sizing size_actuator(const SizingTask& task);

}  // namespace solenoid
