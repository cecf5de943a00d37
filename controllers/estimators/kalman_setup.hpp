#pragma once

#include "controllers/estimators/sensitivity.hpp"
#include "core/mpc/rollout.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace solenoid {

/// An ExtendedKalman takes at most so many channels, disturbances, and ticks of delay of all channels together.
struct KalmanLimits {
  static constexpr int channels = 8, disturbances = 4, delay_ticks = 64;
};

/// A channel measures a combination of the model's states, `delay_ticks` ticks ago:
///
///     z[k] = round(h' x[k - D] + offset + sum_i g_i d_i[k - D] + white noise),   held inside [low, high]
///
/// with h = `states`, D = `delay_ticks`, and g_i of the disturbances. Rounding to steps of `quantum` counts as more
/// white noise, of variance quantum^2/12.
template <HybridModel M>
struct KalmanChannel {
  StateOf<M> states{};
  double offset = 0.0;
  double sigma = 0.0;
  double quantum = 0.0;
  int delay_ticks = 0;
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();

  /// The channel of one state.
  static KalmanChannel of(std::size_t state, double noise_sigma, double step = 0.0, int delay = 0) {
    KalmanChannel channel{.sigma = noise_sigma, .quantum = step, .delay_ticks = delay};
    channel.states.at(state) = 1.0;
    return channel;
  }
  /// Variance of the noise, rounding included.
  double variance() const { return sigma * sigma + quantum * quantum / 12; }
  /// Whether a value at the end of the range says no more than what is expected anyway.
  bool saturated(double measured, double expected) const {
    return (measured >= high - quantum && expected > measured) || (measured <= low + quantum && expected < measured);
  }
};

/// A disturbance d adds to the model's states, or to its channels, what the model knows nothing of:
///
///     x[k+1] = step(x[k], s[k], u[k], dt) + dt b d[k],   z_c has g_c d,   d[k+1] = exp(-dt/tau) d[k] + w[k]
///     var w  = sigma^2 (1 - exp(-2 dt/tau)) + dt drift^2
///
/// with b = `states` (per second), g = `channels`, tau = `memory_s`. At a start d ~ N(0, sigma^2), which stays its
/// distribution while drift = 0; tau = infinity makes it integrate, and then `drift` alone moves it.
template <HybridModel M>
struct KalmanDisturbance {
  StateOf<M> states{};
  std::array<double, KalmanLimits::channels> channels{};
  double sigma = 0.0;
  double memory_s = std::numeric_limits<double>::infinity();
  double drift = 0.0;  ///< [unit of d / s^0.5]

  /// The share of d that a tick leaves.
  double kept(double tick_s) const { return std::exp(-tick_s / memory_s); }
  /// Variance of what a tick adds.
  double renewed(double tick_s) const {
    return -sigma * sigma * std::expm1(-2 * tick_s / memory_s) + tick_s * drift * drift;
  }
};

/// What disturbances of these values, value(i) of the i-th, add to the states per second: sum_i b_i d_i.
template <HybridModel M, class Value>
StateOf<M> disturbance_rate(const std::vector<KalmanDisturbance<M>>& disturbances, const Value& value) noexcept {
  StateOf<M> rate{};
  for (std::size_t i = 0; i < disturbances.size(); ++i)
    for (std::size_t k = 0; k < M::state_size; ++k) rate[k] += disturbances[i].states[k] * value(i);
  return rate;
}

/// What an ExtendedKalman believes of the sensors, of what the model leaves out, and of the state before it has
/// measured anything.
template <HybridModel M>
struct KalmanSetup {
  std::vector<KalmanChannel<M>> channels;
  std::vector<KalmanDisturbance<M>> disturbances;
  StateOf<M> process_sigma{};  ///< unmodelled change of each state [unit / s^0.5]
  StateOf<M> start{}, start_sigma{};
  StateOf<M> restart_sigma{};  ///< at later starts, when less is known; 0 stands for start_sigma
  StateOf<M> low = filled(-infinity), high = filled(infinity);  ///< where no state of the plant is beyond
  double gate_sigmas = 5.0;  ///< innovations beyond this many standard deviations lose weight

  static constexpr double infinity = std::numeric_limits<double>::infinity();

  /// Throws std::invalid_argument, naming the field.
  void check() const {
    require(!channels.empty() && channels.size() <= KalmanLimits::channels, "channels: there must be 1 to 8");
    require(disturbances.size() <= KalmanLimits::disturbances, "disturbances: there may be at most 4");
    require(gate_sigmas > 0, "gate_sigmas: must be above 0");
    int delays = 0;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      check_channel(channels[c], "channel " + std::to_string(c));
      delays += channels[c].delay_ticks;
      require(delays <= KalmanLimits::delay_ticks, "delay_ticks: all channels together may have at most 64");
    }
    for (std::size_t i = 0; i < disturbances.size(); ++i) {
      const KalmanDisturbance<M>& d = disturbances[i];
      const std::string name = "disturbance " + std::to_string(i);
      require(finite(d.sigma) && finite(d.drift), name + ": sigma and drift must be finite, at least 0");
      require(d.memory_s > 0, name + ": memory_s must be above 0");
    }
    for (std::size_t i = 0; i < M::state_size; ++i) {
      const std::string name = "state " + std::to_string(i);
      require(finite(process_sigma[i]) && finite(start_sigma[i]) && finite(restart_sigma[i]),
              name + ": standard deviations must be finite, at least 0");
      require(std::isfinite(start[i]) && low[i] < high[i], name + ": needs a finite start and low < high");
    }
  }

 private:
  static StateOf<M> filled(double value) {
    StateOf<M> x{};
    x.fill(value);
    return x;
  }
  static bool finite(double sigma) { return std::isfinite(sigma) && sigma >= 0; }
  static void require(bool holds, const std::string& what) {
    if (!holds) throw std::invalid_argument("extended Kalman filter: " + what);
  }
  static void check_channel(const KalmanChannel<M>& c, const std::string& name) {
    require(finite(c.sigma) && finite(c.quantum), name + ": sigma and quantum must be finite, at least 0");
    require(c.variance() > 0, name + ": sigma or quantum must be above 0");
    require(c.delay_ticks >= 0 && c.delay_ticks <= KalmanLimits::delay_ticks, name + ": delay_ticks must be 0 to 64");
    require(c.low < c.high && std::isfinite(c.offset), name + ": needs low < high and a finite offset");
  }
};

/// States and disturbances of a filter, c = (x, d), are at most so many.
template <HybridModel M>
inline constexpr int most_core = int{M::state_size} + KalmanLimits::disturbances;
/// A vector c.
template <HybridModel M>
using CoreVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, most_core<M>, 1>;
/// A matrix over c.
template <HybridModel M>
using CoreMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, most_core<M>, most_core<M>>;

/// The model whose step is M's smooth_step where M has one: what Jacobians are taken of.
template <HybridModel M>
struct Smoothed {
  static constexpr std::size_t state_size = M::state_size, switched_size = M::switched_size,
                               continuous_size = M::continuous_size, output_size = M::output_size;
  const M& model;

  template <class S>
  Vector<S, state_size> step(const Vector<S, state_size>& x, const Vector<S, switched_size>& s,
                             const Vector<S, continuous_size>& u, double dt) const {
    return model_step<M, Dynamics::smoothed, S>(model, x, s, u, dt);
  }
  template <class S>
  Vector<S, output_size> output(const Vector<S, state_size>& x) const {
    return model.template output<S>(x);
  }
};

/// Jacobian of a tick of states and disturbances, by forward differentiation of the model's step (smooth_step where it
/// has one): F = [J, dt B; 0, diag exp(-dt/tau)]. No allocation.
template <HybridModel M>
void linearise_core(const M& model, const KalmanSetup<M>& setup, const StateOf<M>& state, const SwitchedOf<M>& switched,
                    const ContinuousOf<M>& continuous, double tick_s, CoreMatrix<M>& f) noexcept {
  constexpr int n = M::state_size;
  const int size = n + static_cast<int>(setup.disturbances.size());
  Eigen::Matrix<double, n, n> jacobian;
  linearise(Smoothed<M>{model}, state, switched, continuous, tick_s, jacobian);
  f.setZero(size, size);
  f.template topLeftCorner<n, n>() = jacobian;
  for (int j = n; j < size; ++j) {
    const KalmanDisturbance<M>& d = setup.disturbances[static_cast<std::size_t>(j - n)];
    for (int i = 0; i < n; ++i) f(i, j) = tick_s * d.states[static_cast<std::size_t>(i)];
    f(j, j) = d.kept(tick_s);
  }
}

/// The row (h, g) of a channel over states and disturbances.
template <HybridModel M>
CoreVector<M> channel_row(const KalmanSetup<M>& setup, std::size_t channel) noexcept {
  constexpr int n = M::state_size;
  CoreVector<M> row(n + static_cast<int>(setup.disturbances.size()));
  for (int i = 0; i < n; ++i) row[i] = setup.channels[channel].states[static_cast<std::size_t>(i)];
  for (std::size_t i = 0; i < setup.disturbances.size(); ++i)
    row[n + static_cast<int>(i)] = setup.disturbances[i].channels[channel];
  return row;
}

}  // namespace solenoid
