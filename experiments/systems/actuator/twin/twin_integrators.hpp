#pragma once

#include "experiments/systems/actuator/twin/servo_travel.hpp"
#include "experiments/systems/actuator/twin/twin_physics.hpp"
#include "experiments/systems/actuator/twin/valve_travel.hpp"

namespace solenoid {

/// Advances a twin state over a span in which commands do not change.
///
/// fixed     classical Runge-Kutta 4 in equal steps, the valves' mean opening over each step; the LuGre bristle, stiff
///           at speed, by Strang splitting with its exact solution at constant velocity; a velocity that would change
///           its sign stops at zero where it crosses; end stops are inelastic. Second order.
/// adaptive  dense-output Dormand-Prince 5 (Boost.Odeint) restarted at every kink of the valves; stick, slip and end
///           stops located on the dense output by toms748 (Boost.Math).
class TwinIntegrator {
 public:
  TwinIntegrator(const TwinPhysics& physics, const ModeSet& modes);

  /// From `from_s` to `to_s`. Once a step of the adaptive method fails, the state is not a number.
  void advance(TwinState& x, ValveActuation& valves, double motor_command_n, double from_s, double to_s) noexcept;
  /// The same with servo valves; openings over a fixed step are those at its middle.
  void advance(TwinState& x, const ServoActuation& valves, double motor_command_n, double from_s, double to_s) noexcept;

 private:
  /// Openings from `at(time)`.
  template <class At>
  struct Span {
    const At& at;
    double motor_command_n;
  };
  void fixed_step(TwinState& x, const Openings& opening, double motor_command_n, double h) const noexcept;
  template <class At>
  void advance_adaptive(TwinState& x, const Span<At>& span, double from_s, double to_s) const;
  /// To to_s or to the first event; returns where it ended.
  template <class At>
  double smooth_piece(TwinState& x, const Span<At>& span, SlideMotion motion, double from_s, double to_s) const;
  template <class Opening>
  Openings blended(const Opening& opening) const noexcept;

  const TwinPhysics& physics_;
  std::size_t coils_;
  Openings offset_{};
  std::array<Openings, max_switches> gain_{};
};

}  // namespace solenoid
