#include "solvers/rounding/pulse_width.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double most_owed = 0.4;  // of an interval; what no pulse can make up for is forgotten

}  // namespace

void PulseWidth::prepare(const ModeSet& modes, const SwitchTiming& timing, const RelaxedGrid& grid) {
  for (const int length : grid.intervals)
    if (length > longest_interval)
      throw std::invalid_argument(fmt::format(
          "pulse width: mode set '{}' needs intervals of {} steps, which are cut into pulses of one (allowed: 1 to {})",
          modes.name(), length, longest_interval));
  timing_ = timing;
  intervals_ = grid.intervals;
  wanted_.prepare(timing, grid);
}

void PulseWidth::round(const ModeSet& modes, const DelayLines& in_flight, std::span<const double> weights,
                       const ModulatorState& at_begin, std::span<int> mode, std::span<SwitchStates<double>> owed,
                       std::span<SwitchStates<double>> owed_sum) noexcept {
  round(modes, in_flight, weights, at_begin.owed, mode, owed);
  std::ranges::fill(owed_sum, SwitchStates<double>{});
}

void PulseWidth::round(const ModeSet& modes, const DelayLines& in_flight, std::span<const double> weights,
                       const SwitchStates<double>& owed_at_begin, std::span<int> mode,
                       std::span<SwitchStates<double>> owed) noexcept {
  ModulatedSteps steps(modes, timing_, in_flight, {owed_at_begin, {}});
  wanted_.read(modes, in_flight, weights);
  std::size_t step = 0;
  for (std::size_t k = 0; k < intervals_.size(); ++k) {
    ModulatorState most;
    most.owed.fill(most_owed * intervals_[k]);
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c)
      choose(c, k, step, steps.lines.line(c), (steps.lines.commanded() >> c) & 1u, steps.state.owed[c]);
    for (int i = 0; i < intervals_[k]; ++i, ++step) {
      owed[step] = steps.state.owed;
      mode[step] = steps.command(scheduled(i));
      steps.pass(wanted_.at(step), most);
    }
  }
}

void PulseWidth::choose(std::size_t c, std::size_t k, std::size_t first, DelayLines::Line line, bool on,
                        double owed) noexcept {
  const int steps = intervals_[k];
  const int ahead = steps + (k + 1 < intervals_.size() ? intervals_[k + 1] : 0);
  std::array<double, 2 * longest_interval> wanted{};
  for (int i = 0; i < ahead; ++i)
    wanted[static_cast<std::size_t>(i)] = wanted_.at(first + static_cast<std::size_t>(i))[c];
  double best = std::numeric_limits<double>::infinity();
  for (std::uint32_t schedule = 0; schedule < (1u << steps); ++schedule) {
    DelayLines::Line trial = line;
    bool last = on;
    double error = owed, sum = 0.0;
    for (int i = 0; i < ahead && sum < best; ++i, ++trial.age) {
      const bool now = i < steps ? (schedule >> i) & 1u : last;
      if (now != last) {
        sum += trial.age < timing_.least(c, last) ? std::numeric_limits<double>::infinity() : edge_price_;
        trial = {DelayLines::after_edge(trial.states, now, now ? timing_.rise[c] : timing_.fall[c]), 0};
        last = now;
      }
      error += wanted[static_cast<std::size_t>(i)] - static_cast<double>(trial.states & 1);
      sum += error * error;
      trial.states >>= 1;
    }
    if (sum < best) best = sum, schedule_[c] = schedule;
  }
}

/// The pattern of step i of the interval at hand.
SwitchPattern PulseWidth::scheduled(int i) const noexcept {
  SwitchPattern pattern = 0;
  for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c)
    pattern |= ((schedule_[c] >> i) & 1u) << c;
  return pattern;
}

}  // namespace solenoid
