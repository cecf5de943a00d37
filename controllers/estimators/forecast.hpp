#pragma once

#include "core/mpc/mode_set.hpp"
#include "core/mpc/problem.hpp"

#include <algorithm>

namespace solenoid {

/// Delay compensation: the state and the commands in flight `ticks` steps of dt from now, when a plan that starts to be
/// computed now takes effect. commanded(j) is what will be commanded as step j begins, motor(j, x) the continuous input
/// applied in it at state x. No allocation or exception.
template <HybridModel M, class Commanded, class Motor>
StateOf<M> forecast(const M& model, const ModeSet& modes, const SwitchTiming& timing, StateOf<M> state,
                    DelayLines& lines, int ticks, double dt, const Commanded& commanded, const Motor& motor) noexcept {
  SwitchedOf<M> switched{};
  for (int j = 0; j < ticks; ++j) {
    lines.command(commanded(j), timing);
    std::ranges::copy(modes.point(lines.effective()), switched.begin());
    state = model.template step<double>(state, switched, motor(j, state), dt);
    lines.advance(1);
  }
  return state;
}

}  // namespace solenoid
