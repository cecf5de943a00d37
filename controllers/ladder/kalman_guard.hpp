#pragma once

#include "controllers/estimators/extended_kalman.hpp"
#include "controllers/ladder/guard.hpp"
#include "core/mpc/rollout.hpp"
#include "core/system/description.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace solenoid {

/// The Guard of a system that has nothing but its switches: an extended Kalman filter watches the channels, and one mode
/// held over the problem's horizon stands in for a plan, the best of all by the exact prediction. Its time is bounded:
/// modes x steps of the model.
template <HybridModel M>
class KalmanGuard final : public Guard {
 public:
  /// `problem`: of one block. `rest`: of each state, magnitudes up to which the plant counts as at rest.
  KalmanGuard(Problem<M> problem, const KalmanSetup<M>& setup, std::vector<OutputSource> outputs,
              const StateOf<M>& rest)
      : problem_(std::move(problem)),
        plan_(problem_),
        timing_(problem_.modes, problem_.horizon.dt_s),
        outputs_(std::move(outputs)),
        rest_(rest),
        watch_(problem_.model, setup, problem_.horizon.dt_s),
        new_watch_(watch_),
        channels_(setup.channels.size()) {}

  StateValues watch(const Measurement& believed) noexcept override {
    return padded<max_states>(watch_.update(std::span(believed.value).first(channels_), believed.age_s));
  }
  void applied(std::span<const double> switched, const ContinuousValues& continuous) noexcept override {
    SwitchedOf<M> own{};
    std::ranges::copy(switched, own.begin());
    watch_.applied(own, first<M::continuous_size>(continuous));
  }
  ChannelValues innovations() const noexcept override {
    ChannelValues squares{};
    std::copy_n(watch_.innovations().begin(), channels_, squares.begin());
    return squares;
  }
  ChannelValues expected_change(const StateValues&, std::span<const double>) const noexcept override { return {}; }
  bool at_rest(const StateValues& state) const noexcept override {
    for (std::size_t i = 0; i < M::state_size; ++i)
      if (!(std::abs(state[i]) <= rest_[i])) return false;
    return true;
  }
  void reset() noexcept override { watch_ = new_watch_; }

  SwitchPattern held_mode(const StateValues& state, const DelayLines& lines, const RestartableReference& reference,
                          double time_s) noexcept override {
    problem_.initial = first<M::state_size>(state);
    problem_.lines = lines;
    for (std::size_t j = 0; j < problem_.reference.size(); ++j)
      problem_.reference[j] = outputs(reference.at(time_s + static_cast<double>(j + 1) * problem_.horizon.dt_s));
    const ModeSet& modes = problem_.modes;
    SwitchPattern best = modes.find(lines.commanded()) >= 0 ? lines.commanded() : modes.safe_pattern();
    double least = Bounds<M>::infinity;
    for (int mode = 0; mode < modes.size(); ++mode) {
      if (!lines.may_command(modes.pattern(mode), timing_)) continue;
      plan_.modes.front() = mode;
      const SolveReport report = evaluate(problem_, plan_);
      if (!usable(report.status) || !(report.cost < least)) continue;
      least = report.cost;
      best = modes.pattern(mode);
    }
    return best;
  }

 private:
  OutputOf<M> outputs(const ReferenceSample& desired) const noexcept {
    OutputOf<M> wanted{};
    for (std::size_t i = 0; i < outputs_.size(); ++i)
      wanted[i] = desired.axis[outputs_[i].axis].derivative(outputs_[i].derivative);
    return wanted;
  }

  Problem<M> problem_;
  Plan<M> plan_;
  SwitchTiming timing_;
  std::vector<OutputSource> outputs_;
  StateOf<M> rest_;
  ExtendedKalman<M> watch_, new_watch_;
  std::size_t channels_;
};

}  // namespace solenoid
