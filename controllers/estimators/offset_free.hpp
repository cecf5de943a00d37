#pragma once

#include "core/mpc/hybrid_model.hpp"

#include <utility>

namespace solenoid {

/// A model with additive disturbances that are held over a prediction: how an estimate of them enters it.
///
///     step(x, s, u, dt) = M::step(x, s, u, dt) + dt rate,     output(x) = M::output(x) + shift
///
/// All else is M's. Its bounds stay bounds: an enclosure moves with the states, by the same dt rate. End stops of M do
/// not hold what is added after them.
template <HybridModel M>
class WithDisturbance {
 public:
  static constexpr std::size_t state_size = M::state_size, switched_size = M::switched_size,
                               continuous_size = M::continuous_size, output_size = M::output_size;

  explicit WithDisturbance(M model = M()) : model_(std::move(model)) {}

  /// Holds these from now on: what is added to the states per second (ExtendedKalman::disturbance_rate()), and to the
  /// outputs.
  void set_disturbance(const StateOf<M>& rate, const OutputOf<M>& shift = {}) noexcept {
    rate_ = rate;
    shift_ = shift;
  }
  const StateOf<M>& disturbance_rate() const noexcept { return rate_; }
  const OutputOf<M>& output_shift() const noexcept { return shift_; }
  const M& undisturbed() const noexcept { return model_; }

  template <class S>
  Vector<S, state_size> step(const Vector<S, state_size>& x, const Vector<S, switched_size>& s,
                             const Vector<S, continuous_size>& u, double dt) const {
    return moved<S>(model_.template step<S>(x, s, u, dt), dt);
  }
  template <class S>
  Vector<S, state_size> smooth_step(const Vector<S, state_size>& x, const Vector<S, switched_size>& s,
                                    const Vector<S, continuous_size>& u, double dt) const requires HasSmoothStep<M> {
    return moved<S>(model_.template smooth_step<S>(x, s, u, dt), dt);
  }
  template <class S>
  Vector<S, output_size> output(const Vector<S, state_size>& x) const {
    Vector<S, output_size> z = model_.template output<S>(x);
    for (std::size_t i = 0; i < output_size; ++i) z[i] = z[i] + S(shift_[i]);
    return z;
  }
  template <class S>
  S consumption(const Vector<S, state_size>& x, const Vector<S, switched_size>& s) const requires HasConsumption<M> {
    return model_.template consumption<S>(x, s);
  }
  /// The law compares the setpoint with the shifted outputs: M's own law, whose outputs have no shift, with the setpoint
  /// less the shift.
  template <class S>
  Vector<S, continuous_size> feedback(const Vector<S, state_size>& x,
                                      const OutputOf<M>& setpoint) const requires HasFeedback<M> {
    return model_.template feedback<S>(x, unshifted(setpoint));
  }
  StateOf<M> state_scale() const requires HasStateScale<M> { return model_.state_scale(); }
  template <class S>
  void enclose_step(Vector<S, state_size>& low, Vector<S, state_size>& high,
                    const Vector<S, switched_size>& switched_low, const Vector<S, switched_size>& switched_high,
                    const OutputOf<M>& setpoint, const ContinuousOf<M>& planned,
                    double dt) const requires HasEnclosure<M> {
    model_.template enclose_step<S>(low, high, switched_low, switched_high, unshifted(setpoint), planned, dt);
    low = moved<S>(low, dt);
    high = moved<S>(high, dt);
  }

 private:
  template <class S>
  Vector<S, state_size> moved(Vector<S, state_size> x, double dt) const {
    for (std::size_t i = 0; i < state_size; ++i) x[i] = x[i] + S(dt * rate_[i]);
    return x;
  }
  OutputOf<M> unshifted(OutputOf<M> setpoint) const {
    for (std::size_t i = 0; i < output_size; ++i) setpoint[i] -= shift_[i];
    return setpoint;
  }

  M model_;
  StateOf<M> rate_{};
  OutputOf<M> shift_{};
};

}  // namespace solenoid
