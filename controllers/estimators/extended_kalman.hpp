#pragma once

#include "controllers/estimators/kalman_setup.hpp"
#include "controllers/estimators/late_values.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

namespace solenoid {

/// An extended Kalman filter estimates the state of any HybridModel from channels that are noisy, coarse, late or
/// missing, with additive disturbances as further states.
///
///     X      = (x, d, past outputs w_c[k-1] .. w_c[k-D_c] of every channel that is D_c > 0 ticks late)
///     w_c[k] = h_c' x[k] + g_c' d[k]
///     tick   X through the model under the inputs in effect since the last (applied), P <- A P A' + Q; then the
///            channels one after the other, each a scalar update in Joseph's form
///
/// A channel that is late measures the last of its past outputs: the filter of the augmented system, which for a linear
/// model is the optimal one. The past outputs, not the past states, are carried: one number a tick of delay. During
/// the first D_c ticks after a start such a channel speaks of a time before it, and is left out.
///
/// Values that a tick brings late, by an age that is known only then, are taken where they belong (late_values.hpp),
/// and the state is predicted from there; covariances are of the filter's own tick. A channel's `delay_ticks` come on
/// top.
///
/// The mean takes the model's step, the covariance the Jacobian of smooth_step where there is one.
///
/// A controller that predicts with disturbances that integrate (WithDisturbance) tracks constants without offset, where
/// it settles: with as many of them as channels (Pannocchia and Rawlings, AIChE J. 49 (2003) 426), or, under a condition
/// on the filter's gain, as many as outputs tracked (Maeder, Borrelli and Morari, Automatica 45 (2009) 2214). Both ask
/// that the augmented system be detectable: observability.hpp.
///
/// shapes      X: state_size + disturbances + sum of delays    measured: channels
/// promise     update, applied: no allocation, lock or exception
template <HybridModel M>
class ExtendedKalman {
 public:
  static constexpr int n = M::state_size;
  static constexpr int most = most_core<M> + KalmanLimits::delay_ticks;

  /// Throws std::invalid_argument, naming the field that is wrong.
  ExtendedKalman(M model, KalmanSetup<M> setup, double tick_s)
      : model_(std::move(model)), setup_(std::move(setup)), tick_s_(tick_s) {
    setup_.check();
    if (!(tick_s > 0)) throw std::invalid_argument("extended Kalman filter: tick_s must be above 0");
    core_ = n + static_cast<int>(setup_.disturbances.size());
    size_ = core_;
    for (std::size_t c = 0; c < setup_.channels.size(); ++c) {
      rows_[c] = channel_row(setup_, c);
      variance_[c] = setup_.channels[c].variance();
      past_[c] = size_;
      size_ += setup_.channels[c].delay_ticks;
    }
    process_variance_.resize(core_);
    for (int i = 0; i < n; ++i) process_variance_[i] = tick_s * square(at(setup_.process_sigma, i));
    kept_.resize(core_ - n);
    for (int i = n; i < core_; ++i) {
      process_variance_[i] = at(setup_.disturbances, i - n).renewed(tick_s);
      kept_[i - n] = at(setup_.disturbances, i - n).kept(tick_s);
    }
    start();
    starts_ = 0;
  }

  /// Takes the channels' values of this tick; returns the estimate at this tick. Values that are missing or not finite
  /// are left out. A belief that is not finite, or one that a channel contradicts for long, starts anew at the present:
  /// values of before it, those of the next age_s, are left out. `age_s`: how long before the tick they were measured.
  StateOf<M> update(std::span<const double> measured, double age_s = 0.0) noexcept {
    if (starts_ == 0 || lost())
      start();
    else
      late_.passed({switched_, continuous_});
    const auto is_there = [](double value) { return std::isfinite(value); };
    const bool any = std::ranges::any_of(measured, is_there);
    for (const int back = late_.aim(age_s / tick_s_, any); late_.behind() > back;) predict();
    innovation_ = correct(measured);
    if (!sound()) {
      start();
      late_.aim(age_s / tick_s_, any);
      innovation_ = correct(measured);
    }
    if (!sound()) start();
    now_ = mean_;
    for (int ticks = late_.behind(); ticks > 0; --ticks) advance(now_, late_.inputs(ticks));
    return state();
  }
  /// Tells which inputs act from this tick to the next.
  void applied(const SwitchedOf<M>& switched, const ContinuousOf<M>& continuous) noexcept {
    switched_ = switched;
    continuous_ = continuous;
  }

  StateOf<M> state() const noexcept {
    StateOf<M> x;
    std::copy_n(now_.data(), n, x.begin());
    return x;
  }
  /// Standard deviations of the states.
  StateOf<M> sigma() const noexcept {
    StateOf<M> s;
    for (int i = 0; i < n; ++i) s[static_cast<std::size_t>(i)] = deviation(i);
    return s;
  }
  double disturbance(std::size_t i) const noexcept { return now_[n + static_cast<int>(i)]; }
  double disturbance_sigma(std::size_t i) const noexcept { return deviation(n + static_cast<int>(i)); }
  /// What the disturbances add to the states per second, sum_i b_i d_i: for WithDisturbance.
  StateOf<M> disturbance_rate() const noexcept { return rate_of(now_); }
  /// Covariance of states and disturbances.
  CoreMatrix<M> covariance() const noexcept { return covariance_.topLeftCorner(core_, core_); }

  /// The last tick's normalised innovation squared: chi-square, with as many degrees of freedom as channels counted.
  double innovation() const noexcept { return innovation_; }
  /// The last tick's innovations squared, in their variances; 0 for a channel left out.
  const std::array<double, KalmanLimits::channels>& innovations() const noexcept { return innovations_; }
  /// How often the belief has been started.
  std::int64_t starts() const noexcept { return starts_; }

  const M& model() const noexcept { return model_; }
  const KalmanSetup<M>& setup() const noexcept { return setup_; }

 private:
  using Full = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, most, 1>;
  /// What acts during a tick.
  struct Inputs {
    SwitchedOf<M> switched{};
    ContinuousOf<M> continuous{};
  };
  using Covariance = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, most, most>;

  /// So many ticks in a row with a channel so far off: the belief is wrong beyond repair.
  static constexpr int patience_ticks = 10;
  static constexpr double lost_sigmas = 15.0;

  static double square(double x) noexcept { return x * x; }
  template <class List>
  static const auto& at(const List& list, int i) noexcept {
    return list[static_cast<std::size_t>(i)];
  }
  double deviation(int i) const noexcept { return std::sqrt(std::max(0.0, covariance_(i, i))); }
  bool sound() const noexcept { return mean_.allFinite() && covariance_.allFinite(); }
  bool lost() const noexcept { return std::ranges::max(contradicted_ticks_) >= patience_ticks; }

  /// Makes the belief that of the setup. Past outputs are zero and certain: nothing reads them before they are filled.
  void start() noexcept {
    mean_.setZero(size_);
    covariance_.setZero(size_, size_);
    for (int i = 0; i < n; ++i) {
      const double later = at(setup_.restart_sigma, i);
      mean_[i] = at(setup_.start, i);
      covariance_(i, i) = square(starts_ > 0 && later > 0 ? later : at(setup_.start_sigma, i));
    }
    for (int i = n; i < core_; ++i) covariance_(i, i) = square(at(setup_.disturbances, i - n).sigma);
    contradicted_ticks_ = {};
    change_ = {};
    now_ = mean_;
    late_.start();
    age_ = 0;
    ++starts_;
  }

  StateOf<M> rate_of(const Full& mean) const noexcept {
    return solenoid::disturbance_rate(setup_.disturbances,
                                      [&mean](std::size_t i) { return mean[n + static_cast<int>(i)]; });
  }
  static StateOf<M> states_of(const Full& mean) noexcept {
    StateOf<M> x;
    std::copy_n(mean.data(), n, x.begin());
    return x;
  }
  /// A mean a tick later.
  void advance(Full& mean, const Inputs& in) const noexcept {
    const StateOf<M> x = states_of(mean), rate = rate_of(mean);
    const StateOf<M> next = model_.template step<double>(x, in.switched, in.continuous, tick_s_);
    remember_outputs(mean.data());
    for (int i = 0; i < n; ++i) mean[i] = at(next, i) + tick_s_ * at(rate, i);
    for (int i = n; i < core_; ++i) mean[i] *= kept_[i - n];
  }

  void predict() noexcept {
    const Inputs& in = late_.inputs(late_.behind());
    late_.caught_up();
    linearise_core(model_, setup_, states_of(mean_), in.switched, in.continuous, tick_s_, jacobian_);
    for (std::size_t c = 0; c < setup_.channels.size(); ++c) change_[c] = -rows_[c].dot(mean_.head(core_));
    advance(mean_, in);
    for (std::size_t c = 0; c < setup_.channels.size(); ++c) change_[c] += rows_[c].dot(mean_.head(core_));
    // P is symmetric, so A P A' = A (A P)'.
    advance_columns();
    covariance_.transposeInPlace();
    advance_columns();
    covariance_.diagonal().head(core_) += process_variance_;
    age_ = std::min(age_ + 1, KalmanLimits::delay_ticks);
  }

  /// Multiplies the covariance from the left with the tick's Jacobian A, past outputs included.
  void advance_columns() noexcept {
    CoreVector<M> next(core_);
    for (int j = 0; j < size_; ++j) {
      double* column = &covariance_(0, j);
      remember_outputs(column);
      next.setZero();
      for (int k = 0; k < core_; ++k) next += column[k] * jacobian_.col(k);
      std::copy_n(next.data(), core_, column);
    }
  }

  /// Moves a column's past outputs on by a tick: the newest becomes w_c of its states and disturbances.
  void remember_outputs(double* column) const noexcept {
    for (std::size_t c = 0; c < setup_.channels.size(); ++c) {
      const int delay = setup_.channels[c].delay_ticks;
      if (delay == 0) continue;
      double* past = column + past_[c];
      std::memmove(past + 1, past, static_cast<std::size_t>(delay - 1) * sizeof(double));
      *past = rows_[c].dot(Eigen::Map<const CoreVector<M>>(column, core_));
    }
  }

  /// Returns the normalised innovation squared.
  double correct(std::span<const double> measured) noexcept {
    innovations_ = {};
    double squares = 0.0;
    for (std::size_t c = 0; c < std::min(measured.size(), setup_.channels.size()); ++c) {
      if (!late_.taken() || !std::isfinite(measured[c]) || age_ < setup_.channels[c].delay_ticks) continue;
      innovations_[c] = take(c, measured[c]);
      squares += innovations_[c];
      contradicted_ticks_[c] = innovations_[c] > square(lost_sigmas) ? contradicted_ticks_[c] + 1 : 0;
    }
    covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
    for (int i = 0; i < n; ++i) mean_[i] = std::clamp(mean_[i], at(setup_.low, i), at(setup_.high, i));
    return squares;
  }

  /// Updates the belief with one channel's value; returns its innovation squared, in variances.
  double take(std::size_t c, double value) noexcept {
    const KalmanChannel<M>& channel = setup_.channels[c];
    const Full ph = covariance_with(c);
    double expected = observed(c, mean_) + channel.offset;
    if (late_.rest() != 0.0) expected -= late_.rest() * change_[c];
    const double spread = observed(c, ph);
    if (channel.saturated(value, expected)) return 0.0;
    const double innovation = value - expected, believed = spread + variance_[c];
    const double least = age_ == 0 ? 0.0 : square(innovation / setup_.gate_sigmas);  // at a start anything may be
    const double variance = std::max(believed, least);
    const Full gain = ph / variance;
    mean_ += gain * innovation;
    // (I - K h') P (I - K h')' + K r K', factor by factor: positive whatever the rounding of K.
    covariance_.noalias() -= gain * ph.transpose();
    const Full left = covariance_with(c) - (variance - spread) * gain;
    covariance_.noalias() -= left * gain.transpose();
    return square(innovation) / believed;
  }

  /// What a channel shows of a column: the last of its past outputs, or its combination of states and disturbances.
  double observed(std::size_t c, const Full& column) const noexcept {
    const int delay = setup_.channels[c].delay_ticks;
    return delay > 0 ? column[past_[c] + delay - 1] : rows_[c].dot(column.head(core_));
  }
  /// P h of a channel.
  Full covariance_with(std::size_t c) const noexcept {
    const int delay = setup_.channels[c].delay_ticks;
    if (delay > 0) return covariance_.col(past_[c] + delay - 1);
    Full ph = Full::Zero(size_);
    for (int k = 0; k < core_; ++k)
      if (rows_[c][k] != 0.0) ph += rows_[c][k] * covariance_.col(k);
    return ph;
  }

  M model_;
  KalmanSetup<M> setup_;
  double tick_s_;
  int core_ = 0, size_ = 0;
  std::array<CoreVector<M>, KalmanLimits::channels> rows_;
  std::array<double, KalmanLimits::channels> variance_{};
  std::array<int, KalmanLimits::channels> past_{};  // where in X a channel's past outputs begin
  CoreVector<M> process_variance_, kept_;           // kept_: of each disturbance the share that a tick leaves

  Full mean_;
  Covariance covariance_;
  CoreMatrix<M> jacobian_;
  SwitchedOf<M> switched_{};
  ContinuousOf<M> continuous_{};
  double innovation_ = 0.0;
  std::array<double, KalmanLimits::channels> innovations_{};
  std::array<int, KalmanLimits::channels> contradicted_ticks_{};
  LateValues<Inputs> late_;
  Full now_;                                             // the mean, predicted to the present
  std::array<double, KalmanLimits::channels> change_{};  // of the outputs in the last tick
  int age_ = 0;                                          // ticks since the start, as far as delays ask
  std::int64_t starts_ = 0;
};

}  // namespace solenoid
