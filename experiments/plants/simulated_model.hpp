#pragma once

#include "controllers/estimators/kalman_setup.hpp"
#include "core/mpc/mode_set.hpp"
#include "core/system/signals.hpp"
#include "experiments/plants/simulated_plant.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace solenoid {

/// Any model as the plant: stepped once a tick, commands through the delays of its switches, channels as data. Starts at
/// a given state with the switches at their safe pattern. The same seed gives the same run to the last bit.
template <HybridModel M>
class SimulatedModel final : public SimulatedPlant {
 public:
  /// How the plant is looked at: what a filter is told of its channels is what they do.
  struct Sensing {
    std::vector<KalmanChannel<M>> channels;
    bool ideal = false;  ///< controllers may read the true state
    std::uint64_t seed = 1;
  };

  SimulatedModel(M model, const ModeSet& modes, const StateOf<M>& start, double tick_s, Sensing sensing)
      : model_(std::move(model)),
        modes_(modes),
        timing_(modes, tick_s),
        tick_s_(tick_s),
        state_(start),
        sensing_(std::move(sensing)),
        random_(sensing_.seed) {
    int longest = 0;
    for (const KalmanChannel<M>& channel : sensing_.channels) longest = std::max(longest, channel.delay_ticks);
    past_.assign(static_cast<std::size_t>(longest) + 1, start);
  }

  Measurement read(double time_s) noexcept override {
    for (const std::int64_t due = std::llround(time_s / tick_s_); steps_ < due;) advance();
    Measurement m{.time_s = time_s, .truth = padded<max_states>(state_), .ideal = sensing_.ideal};
    for (std::size_t c = 0; c < sensing_.channels.size(); ++c) m.value[c] = shown(sensing_.channels[c]);
    return m;
  }
  void write(const Command& command) noexcept override {
    lines_.command(command.switches, timing_);
    continuous_ = first<M::continuous_size>(command.continuous);
  }
  double consumed() const override { return consumed_; }

  const StateOf<M>& state() const { return state_; }

 private:
  void advance() noexcept {
    SwitchedOf<M> switched{};
    std::ranges::copy(modes_.point(lines_.effective()), switched.begin());
    if constexpr (HasConsumption<M>) consumed_ += model_.template consumption<double>(state_, switched) * tick_s_;
    state_ = model_.template step<double>(state_, switched, continuous_, tick_s_);
    lines_.advance(1);
    ++steps_;
    past_[static_cast<std::size_t>(steps_) % past_.size()] = state_;
  }

  /// What a channel shows of the state `delay_ticks` ago; before the start, of the start.
  double shown(const KalmanChannel<M>& channel) noexcept {
    const std::int64_t at = std::max<std::int64_t>(0, steps_ - channel.delay_ticks);
    const StateOf<M>& x = past_[static_cast<std::size_t>(at) % past_.size()];
    double value = channel.offset + channel.sigma * normal_(random_);
    for (std::size_t k = 0; k < M::state_size; ++k) value += channel.states[k] * x[k];
    if (channel.quantum > 0) value = channel.quantum * std::round(value / channel.quantum);
    return std::clamp(value, channel.low, channel.high);
  }

  M model_;
  ModeSet modes_;
  SwitchTiming timing_;
  double tick_s_, consumed_ = 0.0;
  StateOf<M> state_;
  Sensing sensing_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<StateOf<M>> past_;
  DelayLines lines_{modes_.safe_pattern()};
  ContinuousOf<M> continuous_{};
  std::int64_t steps_ = 0;
};

}  // namespace solenoid
