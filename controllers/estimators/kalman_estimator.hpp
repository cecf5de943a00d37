#pragma once

#include "controllers/estimators/extended_kalman.hpp"
#include "controllers/estimators/offset_free.hpp"
#include "core/rt/controller.hpp"

#include <algorithm>
#include <span>

namespace solenoid {

/// An ExtendedKalman as the kind of an Estimator (estimator.hpp): the channels of a measurement are the filter's, in
/// their order, and what it believes beyond the state are its disturbances, in theirs.
/// promise  update, applied, detail: no allocation, lock or exception
template <HybridModel M>
class KalmanEstimator {
 public:
  /// Throws std::invalid_argument, naming the field that is wrong.
  KalmanEstimator(M model, KalmanSetup<M> setup, double tick_s)
      : channels_(setup.channels.size()),
        disturbances_(setup.disturbances.size()),
        filter_(std::move(model), std::move(setup), tick_s) {
    static_assert(M::state_size <= max_states && KalmanLimits::disturbances <= max_beliefs);
    if (channels_ > max_channels)
      throw std::invalid_argument("Kalman estimator: channels: a measurement has at most 6");
  }

  StateValues update(const Measurement& measured) noexcept {
    return padded<max_states>(filter_.update(std::span(measured.value).first(channels_), measured.age_s));
  }
  void applied(std::span<const double> switched, const ContinuousValues& continuous) noexcept {
    SwitchedOf<M> own{};
    std::ranges::copy(switched, own.begin());
    filter_.applied(own, first<M::continuous_size>(continuous));
  }
  EstimateDetail detail() const noexcept {
    EstimateDetail d;
    for (std::size_t i = 0; i < disturbances_; ++i) d.belief[i] = filter_.disturbance(i);
    d.sigma = padded<max_states>(filter_.sigma());
    d.innovation = filter_.innovation();
    return d;
  }

 private:
  std::size_t channels_, disturbances_;
  ExtendedKalman<M> filter_;
};

/// What believes those disturbances: the Inputs of an MpcController over WithDisturbance<M>, whose prediction holds them.
template <HybridModel M>
class HeldDisturbances {
 public:
  explicit HeldDisturbances(std::vector<KalmanDisturbance<M>> disturbances = {})
      : disturbances_(std::move(disturbances)) {}

  void believe(const EstimateDetail& found, WithDisturbance<M>& model) const noexcept {
    model.set_disturbance(disturbance_rate(disturbances_, [&found](std::size_t i) { return found.belief[i]; }));
  }
  ContinuousOf<M> apply(const WithDisturbance<M>&, const ReferenceSample&, const StateOf<M>&,
                        const ContinuousOf<M>& planned) const noexcept {
    return planned;
  }

 private:
  std::vector<KalmanDisturbance<M>> disturbances_;
};

}  // namespace solenoid
