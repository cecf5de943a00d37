#include "experiments/systems/actuator/twin/twin_integrators.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <boost/math/tools/toms748_solve.hpp>
#include <boost/numeric/odeint/stepper/generation.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>

namespace solenoid {
namespace {

namespace odeint = boost::numeric::odeint;

TwinState scaled(TwinState x) {
  for (std::size_t i = 0; i < twin_state_size; ++i) x[i] /= twin_scale[i];
  return x;
}
TwinState unscaled(TwinState x) {
  for (std::size_t i = 0; i < twin_state_size; ++i) x[i] *= twin_scale[i];
  return x;
}
TwinState plus(const TwinState& x, double h, const TwinState& dx) {
  TwinState sum;
  for (std::size_t i = 0; i < twin_state_size; ++i) sum[i] = x[i] + h * dx[i];
  return sum;
}

/// Functions of the state that are positive beyond an event.
struct Guards {
  const TwinPhysics& physics;
  SlideMotion motion;
  double motor_command_n;

  static constexpr int count = 3;
  double value(int which, const TwinState& x) const {
    if (motion == SlideMotion::held) return which == 0 ? release(x) : -1.0;
    if (which == 1) return x[velocity] < 0 ? physics.position_min() - x[position] : -1.0;
    if (which == 2) return x[velocity] > 0 ? x[position] - physics.position_max() : -1.0;
    if (motion == SlideMotion::up) return -x[velocity];
    if (motion == SlideMotion::down) return x[velocity];
    return -1.0;
  }

 private:
  /// What pushes a held slide off: force beyond static friction, at an end stop only towards the stroke.
  double release(const TwinState& x) const {
    const double hold = physics.lugre() ? 0.0 : physics.static_friction();
    const double net = physics.applied_force(x, motor_command_n) - physics.friction_at_rest(x);
    if (x[position] <= physics.position_min()) return net - hold;
    if (x[position] >= physics.position_max()) return -net - hold;
    return std::abs(net) - hold;
  }
};

/// The first moment in (begin, end] at which a guard turns positive; infinity if none has at the end.
template <class StateAt>
double first_event(const Guards& guards, const StateAt& at, double begin, double end) {
  double first = std::numeric_limits<double>::infinity();
  const TwinState before = at(begin), after = at(end);
  for (int which = 0; which < Guards::count; ++which) {
    if (!(guards.value(which, after) > 0)) continue;
    if (!(guards.value(which, before) < 0)) {  // left rest and came back within one step: no bracket, stop at its end
      first = std::min(first, end);
      continue;
    }
    std::uintmax_t iterations = 100;
    const auto root = boost::math::tools::toms748_solve([&](double t) { return guards.value(which, at(t)); }, begin,
                                                        end, boost::math::tools::eps_tolerance<double>(50), iterations);
    first = std::min(first, root.second);
  }
  return first;
}

}  // namespace

TwinIntegrator::TwinIntegrator(const TwinPhysics& physics, const ModeSet& modes)
    : physics_(physics), coils_(static_cast<std::size_t>(modes.switch_count())) {
  std::ranges::copy(modes.offset(), offset_.begin());
  for (std::size_t c = 0; c < coils_; ++c) std::ranges::copy(modes.gain(c), gain_[c].begin());
}

template <class Opening>
Openings TwinIntegrator::blended(const Opening& opening) const noexcept {
  Openings sum = offset_;
  for (std::size_t c = 0; c < coils_; ++c) {
    const double o = opening(c);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += gain_[c][i] * o;
  }
  return sum;
}

void TwinIntegrator::advance(TwinState& x, ValveActuation& valves, double motor_command_n, double from_s,
                             double to_s) noexcept {
  const IntegrationChoice& choice = physics_.parameters().integration;
  if (choice.method == Integration::fixed) {
    const double h = (to_s - from_s) / choice.steps;
    for (int i = 0; i < choice.steps; ++i) {
      const double t = from_s + i * h;
      valves.settle(t);
      fixed_step(x, blended([&](std::size_t c) { return valves.mean_opening(c, t, t + h); }), motor_command_n, h);
    }
    return;
  }
  try {
    for (double t = from_s; t < to_s;) {
      valves.settle(t);
      const double until = std::min(to_s, valves.next_kink(t));
      const auto openings = [&](double at_s) {
        return blended([&](std::size_t c) { return valves.opening(c, at_s); });
      };
      advance_adaptive(x, Span<decltype(openings)>{openings, motor_command_n}, t, until);
      t = until;
    }
  } catch (const std::exception&) {
    x.fill(std::numeric_limits<double>::quiet_NaN());
  }
}

void TwinIntegrator::advance(TwinState& x, const ServoActuation& valves, double motor_command_n, double from_s,
                             double to_s) noexcept {
  const IntegrationChoice& choice = physics_.parameters().integration;
  if (choice.method == Integration::fixed) {
    const double h = (to_s - from_s) / choice.steps;
    for (int i = 0; i < choice.steps; ++i) fixed_step(x, valves.openings(from_s + (i + 0.5) * h), motor_command_n, h);
    return;
  }
  try {
    const auto openings = [&](double at_s) { return valves.openings(at_s); };
    advance_adaptive(x, Span<decltype(openings)>{openings, motor_command_n}, from_s, to_s);
  } catch (const std::exception&) {
    x.fill(std::numeric_limits<double>::quiet_NaN());
  }
}

void TwinIntegrator::fixed_step(TwinState& x, const Openings& opening, double motor_command_n,
                                double h) const noexcept {
  const SlideMotion motion = physics_.motion_from(x, motor_command_n);
  const double v = x[velocity];
  if (motion == SlideMotion::smooth) x[twin_bristle] = physics_.bristle_after(x[twin_bristle], v, h / 2);
  const auto slope = [&](const TwinState& at) {
    return physics_.rates_at_fixed_bristle(at, opening, motor_command_n, motion);
  };
  const TwinState k1 = slope(x), k2 = slope(plus(x, h / 2, k1)), k3 = slope(plus(x, h / 2, k2)),
                  k4 = slope(plus(x, h, k3));
  const double y = x[position];
  for (std::size_t i = 0; i < twin_state_size; ++i) x[i] += h / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
  if (motion == SlideMotion::smooth) x[twin_bristle] = physics_.bristle_after(x[twin_bristle], x[velocity], h / 2);
  const bool reversed =
      (motion == SlideMotion::up && x[velocity] < 0) || (motion == SlideMotion::down && x[velocity] > 0);
  if (reversed) {
    x[position] = y + 0.5 * v * h * v / (v - x[velocity]);
    x[velocity] = 0.0;
  }
  if (x[position] < physics_.position_min() || x[position] > physics_.position_max()) {
    const bool low = x[position] < physics_.position_min();
    x[position] = low ? physics_.position_min() : physics_.position_max();
    x[velocity] = low ? std::max(0.0, x[velocity]) : std::min(0.0, x[velocity]);
  }
}

template <class At>
void TwinIntegrator::advance_adaptive(TwinState& x, const Span<At>& span, double from_s, double to_s) const {
  for (double t = from_s; t < to_s;) {
    const SlideMotion motion = physics_.motion_from(x, span.motor_command_n);
    t = smooth_piece(x, span, motion, t, to_s);
  }
}

template <class At>
double TwinIntegrator::smooth_piece(TwinState& x, const Span<At>& span, SlideMotion motion, double from_s,
                                    double to_s) const {
  const double tolerance = physics_.parameters().integration.tolerance;
  auto stepper = odeint::make_dense_output(tolerance, tolerance, odeint::runge_kutta_dopri5<TwinState>());
  const auto system = [&](const TwinState& at, TwinState& rate, double t) {
    // Just inside the piece at both of its ends, so that an opening without travel is this piece's.
    const double inside = std::clamp(t, from_s, std::nexttoward(to_s, from_s));
    rate = scaled(physics_.rates(unscaled(at), span.at(inside), span.motor_command_n, motion));
  };
  const Guards guards{physics_, motion, span.motor_command_n};
  const auto at = [&](double t) {
    TwinState state;
    stepper.calc_state(t, state);
    return unscaled(state);
  };
  stepper.initialize(scaled(x), from_s, to_s - from_s);
  for (;;) {
    const double begin = stepper.do_step(system).first, end = std::min(stepper.current_time(), to_s);
    const double event = first_event(guards, at, begin, end);
    if (event > end && end < to_s) continue;
    x = at(std::min(event, end));
    if (event > end) return to_s;
    // What ends a sliding piece, reversal or end stop, ends at rest; a released slide starts from rest.
    x[velocity] = 0.0;
    x[position] = std::clamp(x[position], physics_.position_min(), physics_.position_max());
    return event;
  }
}

}  // namespace solenoid
