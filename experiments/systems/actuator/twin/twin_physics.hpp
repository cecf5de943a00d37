#pragma once

#include "core/systems/actuator/dynamics.hpp"
#include "experiments/systems/actuator/twin/twin_flow.hpp"
#include "experiments/systems/actuator/twin/twin_parameters.hpp"

namespace solenoid {

/// Indices of the twin's state. The first four are the actuator's own.
enum TwinIndex : std::size_t {
  twin_mass_a = 4,    ///< air in chamber A [kg]; unused but by heat_transfer
  twin_mass_b = 5,    ///< air in chamber B [kg]
  twin_bristle = 6,   ///< LuGre bristle deflection z [m]
  twin_motor = 7,     ///< motor force at the pitch line [N]
  twin_supply = 8,    ///< supply pressure at the valves [Pa]
  twin_rotor_y = 9,   ///< rotor's pitch-line position [m]
  twin_rotor_v = 10,  ///< and velocity [m/s]
  twin_drawn = 11,    ///< air drawn from the supply so far [kg]
  twin_vented = 12,   ///< air let out to the atmosphere so far [kg]
};
inline constexpr std::size_t twin_state_size = 13;
using TwinState = Vector<double, twin_state_size>;
/// Typical sizes, by which the adaptive integrator's tolerances are relative.
inline constexpr TwinState twin_scale = {0.1, 0.1, 1e5, 1e5, 1e-4, 1e-4, 1e-5, 10.0, 1e5, 0.1, 0.1, 1e-3, 1e-3};

using Openings = SwitchedOf<PneumaticActuator>;

/// How the slide moves: where its friction or an end stop makes the equations non-smooth, one smooth piece each.
enum class SlideMotion {
  smooth,  ///< LuGre friction, inside the stroke
  up,      ///< sliding towards +y under the model's law
  down,    ///< sliding towards -y
  held,    ///< at rest: stuck, or pressed against an end stop
};

/// Right-hand side of the twin, dx/dt = rates(x, openings, motor command, motion). Geometry, gravity, forces and the
/// model's flow law are the controller's own (core/systems/actuator); the rest is docs/reference/twin.md.
class TwinPhysics {
 public:
  explicit TwinPhysics(const TwinParameters& parameters);

  TwinState rates(const TwinState& x, const Openings& opening, double motor_command_n, SlideMotion motion) const;
  /// The same without the bristle's motion, for the integrator that moves it exactly.
  TwinState rates_at_fixed_bristle(const TwinState& x, const Openings& opening, double motor_command_n,
                                   SlideMotion motion) const;
  /// z after dt at constant velocity: the exact solution of dz/dt = v - sigma_0 |v| z/g(v).
  double bristle_after(double z, double v, double dt) const;

  /// Everything but friction [N].
  double applied_force(const TwinState& x, double motor_command_n) const;
  /// The friction that a slide at rest would have to give up before it moves off an end stop [N].
  double friction_at_rest(const TwinState& x) const;
  /// The motion from here on, at a state with the velocity's sign or from rest.
  SlideMotion motion_from(const TwinState& x, double motor_command_n) const;

  double position_min() const { return parameters_.actuator.position_min_m(); }
  double position_max() const { return parameters_.actuator.position_max_m(); }
  double static_friction() const { return parameters_.actuator.static_friction_n; }
  bool lugre() const { return lugre_; }
  const PneumaticActuator& model() const { return model_; }
  const TwinParameters& parameters() const { return parameters_; }
  const ValveOrifices& orifices() const { return orifices_; }

  /// The regulator's pressure from now on [Pa].
  void set_supply(double pressure_pa) noexcept;
  /// A hole from a chamber (0: A, 1: B) to the atmosphere, as a share of its exhaust's opening.
  void set_leak(std::size_t chamber, double share) noexcept { leak_[chamber] = share; }

  /// At rest at y, both chambers and the reservoir settled, coils off.
  TwinState state_at_rest(double y) const;
  /// Temperature of a chamber [K] under heat_transfer.
  double temperature(double pressure, double length_m, double area_m2, double mass_kg) const;

 private:
  /// Air flow into one chamber through its two valves [kg/s], positive inwards.
  struct ChamberFlow {
    double fill, exhaust;
  };
  ChamberFlow chamber_flow(double pressure, double temperature_k, double supply, double fill_opening,
                           double exhaust_opening) const;
  /// dP/dt of a chamber.
  double pressure_rate(double pressure, double temperature_k, double length_m, double length_rate, double area_m2,
                       const ChamberFlow& flow) const;
  double contact_force(const TwinState& x) const;
  double stribeck(double v) const;
  double friction(const TwinState& x, SlideMotion motion, double bristle_rate) const;
  double bristle_rate(double z, double v) const;
  void air_rates(const TwinState& x, const Openings& opening, TwinState& dx) const;
  void slide_rates(const TwinState& x, double motor_command_n, SlideMotion motion, TwinState& dx) const;
  void motor_rates(const TwinState& x, double motor_command_n, TwinState& dx) const;

  TwinParameters parameters_;
  PneumaticActuator model_;
  ValveOrifices orifices_;
  std::array<double, 2> leak_{};
  double area_a_, area_b_, mass_kg_, rotor_mass_kg_, bristle_damping_;
  bool lugre_, iso_, heat_, polytropic_, reservoir_, backlash_, lagged_;
};

}  // namespace solenoid
