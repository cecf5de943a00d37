#include "solvers/rounding/pulse_width.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double edge_price = 0.05;  // in squared steps: breaks ties, and no more
constexpr double most_owed = 0.4;    // of an interval; what no pulse can make up for is forgotten

}  // namespace

void PulseWidth::prepare(const ModeSet& modes, const SwitchTiming& timing, const RelaxedGrid& grid) {
  for (const int length : grid.intervals)
    if (length > longest_interval)
      throw std::invalid_argument(fmt::format(
          "pulse width: mode set '{}' needs intervals of {} steps, which are cut into pulses of one (allowed: 1 to {})",
          modes.name(), length, longest_interval));
  timing_ = timing;
  intervals_ = grid.intervals;
}

void PulseWidth::round(const ModeSet& modes, const DelayLines& in_flight, std::span<const double> weights,
                       const SwitchStates<double>& owed_at_begin, std::span<int> mode,
                       std::span<SwitchStates<double>> owed) noexcept {
  DelayLines lines = in_flight;
  SwitchStates<double> error = owed_at_begin;
  before_ = pattern_states<double>(lines.commanded());
  int hold = std::max(0, modes.find(lines.commanded()));
  std::size_t step = 0;
  for (std::size_t k = 0; k < intervals_.size(); ++k) {
    want(modes, lines, weights, k);
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c)
      choose(c, k, lines.line(c), (lines.commanded() >> c) & 1u, error[c]);
    for (int i = 0; i < intervals_[k]; ++i, ++step) {
      owed[step] = error;
      const SwitchPattern pattern = allowed(modes, lines, i, error);
      if (const int found = modes.find(pattern); found >= 0) hold = found;
      mode[step] = hold;
      lines.command(modes.pattern(hold), timing_);
      const SwitchPattern in_effect = lines.effective();
      for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c) {
        error[c] += wanted_[static_cast<std::size_t>(i)][c] - static_cast<double>((in_effect >> c) & 1u);
        error[c] = std::clamp(error[c], -most_owed * intervals_[k], most_owed * intervals_[k]);
      }
      lines.advance(1);
    }
  }
}

/// Switch states in effect in interval k and the next, as the relaxed prediction has them; before the first the
/// commands in flight count.
void PulseWidth::want(const ModeSet& modes, const DelayLines& lines, std::span<const double> weights,
                      std::size_t k) noexcept {
  const auto width = static_cast<std::size_t>(modes.size());
  SwitchStates<double> before = before_;
  std::size_t at = 0;
  for (std::size_t interval = k; interval < std::min(k + 2, intervals_.size()); ++interval) {
    const auto c = commanded_states<double>(modes, weights.subspan(interval * width, width));
    for (int i = 0; i < intervals_[interval]; ++i, ++at) {
      const auto in_flight = pattern_states<double>(lines.effective(i));
      for (std::size_t s = 0; s < static_cast<std::size_t>(timing_.switches); ++s)
        wanted_[at][s] =
            effective_state(interval == 0 ? in_flight[s] : before[s], c[s], i, timing_.rise[s], timing_.fall[s]);
    }
    before = c;
    if (interval == k) before_ = c;
  }
}

void PulseWidth::choose(std::size_t c, std::size_t k, DelayLines::Line line, bool on, double owed) noexcept {
  const int steps = intervals_[k];
  const int ahead = steps + (k + 1 < intervals_.size() ? intervals_[k + 1] : 0);
  double best = std::numeric_limits<double>::infinity();
  for (std::uint32_t schedule = 0; schedule < (1u << steps); ++schedule) {
    DelayLines::Line trial = line;
    bool last = on;
    double error = owed, sum = 0.0;
    for (int i = 0; i < ahead && sum < best; ++i, ++trial.age) {
      const bool now = i < steps ? (schedule >> i) & 1u : last;
      if (now != last) {
        sum += trial.age < timing_.least(c, last) ? std::numeric_limits<double>::infinity() : edge_price;
        trial = {DelayLines::after_edge(trial.states, now, now ? timing_.rise[c] : timing_.fall[c]), 0};
        last = now;
      }
      error += wanted_[static_cast<std::size_t>(i)][c] - static_cast<double>(trial.states & 1);
      sum += error * error;
      trial.states >>= 1;
    }
    if (sum < best) best = sum, schedule_[c] = schedule;
  }
}

/// The scheduled pattern of step i, less what excludes each other or may not change at once; the one in force where a
/// dwell forbids it.
SwitchPattern PulseWidth::allowed(const ModeSet& modes, const DelayLines& lines, int i,
                                  const SwitchStates<double>& owed) const noexcept {
  SwitchPattern pattern = 0;
  for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c)
    pattern |= ((schedule_[c] >> i) & 1u) << c;
  while (pattern != 0 && modes.find(pattern) < 0) {
    std::size_t least = max_switches;
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c)
      if (((pattern >> c) & 1u) != 0 && (least == max_switches || owed[c] < owed[least])) least = c;
    pattern &= ~(SwitchPattern{1} << least);
  }
  pattern = one_change_a_group(modes, pattern, lines.commanded(), owed);
  return lines.may_command(pattern, timing_) ? pattern : lines.commanded();
}

/// Of a group that may change one switch at a time only the change that is owed most, of those that leave the group as
/// some mode has it.
SwitchPattern PulseWidth::one_change_a_group(const ModeSet& modes, SwitchPattern pattern, SwitchPattern before,
                                             const SwitchStates<double>& owed) const noexcept {
  for (std::size_t g = 0; g < timing_.groups; ++g) {
    const SwitchPattern group = timing_.group[g], changed = (pattern ^ before) & group;
    if (one_at_a_time(changed, std::span(&group, 1))) continue;
    const auto possible = [&](SwitchPattern inside) {
      return std::ranges::any_of(modes.modes(), [&](const Mode& m) { return (m.pattern & group) == inside; });
    };
    SwitchPattern kept = 0;
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c) {
      const SwitchPattern one = SwitchPattern{1} << c;
      const double due = (pattern & one) != 0 ? owed[c] : -owed[c];
      if ((changed & one) != 0 && due > most && possible((before ^ one) & group)) kept = one, most = due;
    }
    pattern = (pattern & ~group) | ((before ^ kept) & group);
  }
  return pattern;
}

}  // namespace solenoid
