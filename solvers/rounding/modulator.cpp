#include "solvers/rounding/modulator.hpp"

#include <algorithm>
#include <limits>

namespace solenoid {
namespace {

/// The wished switches less what excludes each other.
SwitchPattern some_mode(const ModeSet& modes, SwitchPattern pattern, const SwitchStates<double>& owed) noexcept {
  while (pattern != 0 && modes.find(pattern) < 0) {
    std::size_t least = max_switches;
    for (std::size_t c = 0; c < static_cast<std::size_t>(modes.switch_count()); ++c)
      if (((pattern >> c) & 1u) != 0 && (least == max_switches || owed[c] < owed[least])) least = c;
    pattern &= ~(SwitchPattern{1} << least);
  }
  return pattern;
}

/// Of a group that may change one switch at a time only the change that is owed most, of those that leave the group as
/// some mode has it.
SwitchPattern one_change_a_group(const ModeSet& modes, const SwitchTiming& timing, SwitchPattern pattern,
                                 SwitchPattern before, const SwitchStates<double>& owed) noexcept {
  for (std::size_t g = 0; g < timing.groups; ++g) {
    const SwitchPattern group = timing.group[g], changed = (pattern ^ before) & group;
    if (one_at_a_time(changed, std::span(&group, 1))) continue;
    const auto possible = [&](SwitchPattern inside) {
      return std::ranges::any_of(modes.modes(), [&](const Mode& m) { return (m.pattern & group) == inside; });
    };
    SwitchPattern kept = 0;
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing.switches); ++c) {
      const SwitchPattern one = SwitchPattern{1} << c;
      const double due = (pattern & one) != 0 ? owed[c] : -owed[c];
      if ((changed & one) != 0 && due > most && possible((before ^ one) & group)) kept = one, most = due;
    }
    pattern = (pattern & ~group) | ((before ^ kept) & group);
  }
  return pattern;
}

}  // namespace

void WantedStates::prepare(const SwitchTiming& timing, const RelaxedGrid& grid) {
  timing_ = timing;
  intervals_ = grid.intervals;
  std::size_t steps = 0;
  for (const int length : intervals_) steps += static_cast<std::size_t>(length);
  states_.assign(steps, {});
}

void WantedStates::read(const ModeSet& modes, const DelayLines& lines, std::span<const double> weights) noexcept {
  const auto width = static_cast<std::size_t>(modes.size());
  SwitchStates<double> before{};
  std::size_t step = 0;
  for (std::size_t k = 0; k < intervals_.size(); ++k) {
    const auto c = commanded_states<double>(modes, weights.subspan(k * width, width));
    for (int i = 0; i < intervals_[k]; ++i, ++step) {
      if (k == 0) before = pattern_states<double>(lines.effective(i));
      for (std::size_t s = 0; s < static_cast<std::size_t>(timing_.switches); ++s)
        states_[step][s] = effective_state(before[s], c[s], i, timing_.rise[s], timing_.fall[s]);
    }
    before = c;
  }
}

int least_in_effect(const SwitchTiming& timing, std::size_t c, bool on) noexcept {
  const int back = on ? timing.fall[c] : timing.rise[c], there = on ? timing.rise[c] : timing.fall[c];
  return std::max(1, std::max(1, timing.least(c, on)) + back - there);
}

SwitchPattern allowed_pattern(const ModeSet& modes, const SwitchTiming& timing, const DelayLines& lines,
                              SwitchPattern wished, const SwitchStates<double>& owed) noexcept {
  const SwitchPattern pattern =
      one_change_a_group(modes, timing, some_mode(modes, wished, owed), lines.commanded(), owed);
  return lines.may_command(pattern, timing) ? pattern : lines.commanded();
}

int ModulatedSteps::command(SwitchPattern wished) noexcept {
  const SwitchPattern pattern = allowed_pattern(modes, timing, lines, wished, state.owed);
  if (const int found = modes.find(pattern); found >= 0) mode = found;
  lines.command(modes.pattern(mode), timing);
  return mode;
}

void ModulatedSteps::pass(const SwitchStates<double>& wanted, const ModulatorState& most) noexcept {
  const SwitchPattern in_effect = lines.effective();
  for (std::size_t c = 0; c < static_cast<std::size_t>(timing.switches); ++c) {
    state.owed[c] += wanted[c] - static_cast<double>((in_effect >> c) & 1u);
    state.owed[c] = std::clamp(state.owed[c], -most.owed[c], most.owed[c]);
    state.owed_sum[c] = std::clamp(state.owed_sum[c] + state.owed[c], -most.owed_sum[c], most.owed_sum[c]);
  }
  lines.advance(1);
}

}  // namespace solenoid
