#include "solvers/rounding/switch_limits.hpp"

#include <algorithm>
#include <array>

namespace solenoid {

bool SwitchLimits::counts_changes() const noexcept {
  if (max_changes != unlimited) return true;
  for (const PerSwitch& s : switches)
    if (s.max_changes != unlimited) return true;
  return false;
}

SwitchLimits one_hot_limits(int modes) {
  SwitchLimits limits;
  for (int m = 0; m < modes; ++m) limits.patterns.push_back(SwitchPattern{1} << m);
  limits.switches.resize(limits.patterns.size());
  return limits;
}

SwitchLimits mode_set_limits(const ModeSet& modes, const SwitchTiming& timing, const DelayLines& lines) {
  SwitchLimits limits;
  for (const Mode& mode : modes.modes()) limits.patterns.push_back(mode.pattern);
  for (std::size_t c = 0; c < modes.switches().size(); ++c)
    limits.switches.push_back(
        {static_cast<double>(timing.least(c, true)), static_cast<double>(timing.least(c, false))});
  limits.one_at_a_time.assign(modes.one_at_a_time().begin(), modes.one_at_a_time().end());
  begin_after(timing, lines, limits);
  return limits;
}

void begin_after(const SwitchTiming& timing, const DelayLines& lines, SwitchLimits& limits) noexcept {
  for (std::size_t c = 0; c < limits.switches.size(); ++c) {
    limits.switches[c].age = lines.line(c).age;
    if ((timing.windowed >> c) & 1u)
      limits.switches[c].max_changes = std::max(0, timing.max_changes[c] - lines.changes_within(c, timing.window[c]));
  }
  limits.in_force = lines.commanded();
}

LimitedWalk walk_limits(const SwitchLimits& limits, std::span<const double> dt, std::span<const int> modes) noexcept {
  LimitedWalk walk;
  std::array<double, SwitchLimits::most_switches> age{};
  std::array<int, SwitchLimits::most_switches> count{};
  for (std::size_t c = 0; c < limits.switches.size(); ++c) age[c] = limits.switches[c].age;
  std::int64_t pattern = limits.in_force;
  for (std::size_t k = 0; k < modes.size(); ++k) {
    const std::int64_t next = limits.patterns[static_cast<std::size_t>(modes[k])];
    walk.allowed = walk.allowed &&
                   (pattern < 0 || one_at_a_time(static_cast<SwitchPattern>(pattern ^ next), limits.one_at_a_time));
    for (std::size_t c = 0; c < limits.switches.size() && pattern >= 0; ++c) {
      if (((pattern ^ next) >> c & 1) == 0) continue;
      const SwitchLimits::PerSwitch& s = limits.switches[c];
      walk.allowed = walk.allowed && has_dwelt(age[c], (next >> c & 1) ? s.min_off : s.min_on);
      walk.allowed = walk.allowed && ++count[c] <= s.max_changes && ++walk.changes <= limits.max_changes;
      age[c] = 0.0;
    }
    pattern = next;
    for (double& a : age) a += dt[k];
  }
  return walk;
}

}  // namespace solenoid
