#include "core/mpc/switch_fault.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// Whether a mode opens against what stays on, but by less.
bool in_vain(const std::vector<double>& stays, const SwitchedPoint& mode,
             std::span<const std::array<std::size_t, 2>> opposed) {
  constexpr double tiny = 1e-9;
  return std::ranges::any_of(opposed, [&](const auto& pair) {
    const auto [i, j] = pair;
    const auto against = [&](std::size_t own, std::size_t other) {
      return stays[own] > tiny && mode[other] > tiny && mode[other] < stays[own] - tiny;
    };
    return against(i, j) || against(j, i);
  });
}

}  // namespace

const char* to_string(SwitchFaultKind kind) {
  static constexpr std::array names = {"sound", "stuck on", "stuck off", "leaking", "slow"};
  return names[static_cast<std::size_t>(kind)];
}

std::optional<ModeSet> with_fault(const ModeSet& modes, std::size_t c, const SwitchFault& fault, double dt,
                                  std::span<const std::array<std::size_t, 2>> opposed) {
  if (c >= modes.switches().size())
    throw std::invalid_argument(fmt::format("mode set '{}': there is no switch {}", modes.name(), c));
  std::vector<Switch> switches(modes.switches().begin(), modes.switches().end());
  std::vector<double> offset(modes.offset().begin(), modes.offset().end());
  std::vector<std::vector<double>> gain;
  for (std::size_t s = 0; s < switches.size(); ++s) gain.emplace_back(modes.gain(s).begin(), modes.gain(s).end());
  const double always = fault.opening(0.0), commanded = fault.opening(1.0) - always;
  std::vector<double> stays(offset.size());
  for (std::size_t i = 0; i < offset.size(); ++i) {
    stays[i] = always * gain[c][i];
    offset[i] += stays[i];
    gain[c][i] *= commanded;
  }
  if (fault.kind == SwitchFaultKind::slow) {
    const double longest = max_delay_steps * dt;
    switches[c].rise_delay_s = std::min(longest, switches[c].rise_delay_s + fault.value);
    switches[c].fall_delay_s = std::min(longest, switches[c].fall_delay_s + fault.value);
  }
  const SwitchPattern own = SwitchPattern{1} << c, safe = modes.safe_pattern();
  const bool stuck = commanded == 0.0;
  if (stuck) {  // it moves no more: how long it was on or off binds no one
    Switch& none = switches[c];
    none.min_dwell_s = none.min_on_s = none.min_off_s = none.window_s = 0.0;
    none.max_changes = 0;
  }
  std::vector<Mode> left;
  for (const Mode& mode : modes.modes()) {
    if (mode.pattern != safe &&
        ((stuck && (mode.pattern & own) != 0) || in_vain(stays, modes.point(mode.pattern), opposed)))
      continue;
    left.push_back(mode);
  }
  // A safe pattern that commands a stuck switch says what the pattern without it does.
  SwitchPattern kept_safe = safe;
  if (stuck && (safe & own) != 0 && modes.find(safe & ~own) >= 0) {
    kept_safe = safe & ~own;
    std::erase_if(left, [&](const Mode& mode) { return mode.pattern == safe; });
  }
  if (left.size() < 2) return std::nullopt;
  const std::vector<SwitchPattern> groups(modes.one_at_a_time().begin(), modes.one_at_a_time().end());
  return ModeSet(modes.name(), std::move(switches), std::move(left), std::move(offset), std::move(gain), groups,
                 kept_safe);
}

}  // namespace solenoid
