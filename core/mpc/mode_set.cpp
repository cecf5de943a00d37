#include "core/mpc/mode_set.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

void require(bool condition, const std::string& message) {
  if (!condition) throw std::invalid_argument(message);
}

/// The modes by pattern; throws where one has a switch too many or two are the same.
std::vector<std::pair<SwitchPattern, int>> by_pattern(const std::string& set, std::size_t switches,
                                                      const std::vector<Mode>& modes) {
  require(!modes.empty(), fmt::format("mode set '{}': needs at least one mode", set));
  std::vector<std::pair<SwitchPattern, int>> sorted;
  for (const Mode& mode : modes) {
    if ((mode.pattern & ~first_switches(switches)) != 0)
      require(false,
              fmt::format("mode set '{}': mode '{}' uses a switch beyond the {} there are", set, mode.name, switches));
    sorted.emplace_back(mode.pattern, static_cast<int>(sorted.size()));
  }
  std::ranges::sort(sorted);
  const auto twice = std::ranges::adjacent_find(sorted, {}, &std::pair<SwitchPattern, int>::first);
  if (twice != sorted.end())
    require(false, fmt::format("mode set '{}': modes '{}' and '{}' are the same pattern", set,
                               modes[static_cast<std::size_t>(twice->second)].name,
                               modes[static_cast<std::size_t>((twice + 1)->second)].name));
  return sorted;
}

void check_groups(const std::string& set, std::size_t switches, const std::vector<SwitchPattern>& groups) {
  require(groups.size() <= max_switches,
          fmt::format("mode set '{}': {} groups of switches; at most {}", set, groups.size(), max_switches));
  for (const SwitchPattern group : groups) {
    require((group & ~first_switches(switches)) == 0,
            fmt::format("mode set '{}': a group has a switch beyond the {} there are", set, switches));
    require(std::popcount(group) > 1,
            fmt::format("mode set '{}': a group of one at a time needs two switches or more", set));
  }
}

/// Times this close to a whole number of steps, in steps, are that many: the rounding of a quotient, no more.
constexpr double whole = 1e-6;

double nearest(double steps) { return std::round(steps); }
double at_least(double steps) { return std::ceil(steps - whole); }

int whole_steps(const Switch& s, const char* what, double time_s, double dt, double (*round)(double)) {
  const double steps = round(time_s / dt);
  // The message is built only when wanted: solves measure timing too, and must not allocate.
  if (!(steps >= 0 && steps <= max_delay_steps))
    require(false, fmt::format("switch '{}': {} of {} s is {} steps of {} s; allowed 0 to {} steps", s.name, what,
                               time_s, steps, dt, max_delay_steps));
  return static_cast<int>(steps);
}

}  // namespace

ModeSet::ModeSet(std::string name, std::vector<Switch> switches, std::vector<Mode> modes, std::vector<double> offset,
                 std::vector<std::vector<double>> gain, std::vector<SwitchPattern> one_at_a_time,
                 std::optional<SwitchPattern> safe)
    : name_(std::move(name)),
      switches_(std::move(switches)),
      modes_(std::move(modes)),
      offset_(std::move(offset)),
      gain_(std::move(gain)),
      one_at_a_time_(std::move(one_at_a_time)) {
  require(switches_.size() <= max_switches,
          fmt::format("mode set '{}': {} switches; at most {}", name_, switches_.size(), max_switches));
  require(gain_.size() == switches_.size(), fmt::format("mode set '{}': one gain column a switch", name_));
  require(offset_.size() <= max_switched,
          fmt::format("mode set '{}': {} switched inputs; at most {}", name_, offset_.size(), max_switched));
  for (std::size_t c = 0; c < gain_.size(); ++c)
    require(gain_[c].size() == offset_.size(), fmt::format("mode set '{}': gain of switch '{}' needs {} entries", name_,
                                                           switches_[c].name, offset_.size()));
  by_pattern_ = by_pattern(name_, switches_.size(), modes_);
  check_groups(name_, switches_.size(), one_at_a_time_);
  safe_ = safe.value_or(find(0) >= 0 ? SwitchPattern{0} : pattern(0));
  require(find(safe_) >= 0, fmt::format("mode set '{}': the safe pattern {:b} is no mode", name_, safe_));
  tabulate();
}

void ModeSet::tabulate() {
  chunk_patterns_ = SwitchPattern{1} << std::min(chunk, gain_.size());
  for (std::size_t first = 0; first == 0 || first < gain_.size(); first += chunk) {
    const std::size_t last = std::min(first + chunk, gain_.size());
    for (SwitchPattern pattern = 0; pattern < chunk_patterns_; ++pattern)
      for (std::size_t row = 0; row < offset_.size(); ++row) {
        double value = first == 0 ? offset_[row] : 0.0;
        for (std::size_t c = first; c < last; ++c)
          if ((pattern >> (c - first)) & 1u) value += gain_[c][row];
        sums_.push_back(value);
      }
  }
  lowering_.assign(offset_.size(), 0);
  for (std::size_t row = 0; row < offset_.size(); ++row)
    for (std::size_t c = 0; c < gain_.size(); ++c)
      if (gain_[c][row] < 0.0) lowering_[row] |= SwitchPattern{1} << c;
}

int ModeSet::find(SwitchPattern pattern) const {
  const auto at = std::ranges::lower_bound(by_pattern_, pattern, {}, &std::pair<SwitchPattern, int>::first);
  return at != by_pattern_.end() && at->first == pattern ? at->second : -1;
}

ModeSet ModeSet::with_switches(std::vector<Switch> switches) const {
  require(switches.size() == switches_.size(),
          fmt::format("mode set '{}': {} switches in place of {}", name_, switches.size(), switches_.size()));
  ModeSet timed = *this;
  timed.switches_ = std::move(switches);
  return timed;
}

ModeSet ModeSet::with_delays_scaled(double factor) const {
  ModeSet scaled = *this;
  for (Switch& s : scaled.switches_) {
    s.rise_delay_s *= factor;
    s.fall_delay_s *= factor;
  }
  return scaled;
}

SwitchTiming::SwitchTiming(const ModeSet& modes, double dt) : switches(modes.switch_count()) {
  for (std::size_t c = 0; c < modes.switches().size(); ++c) {
    const Switch& s = modes.switches()[c];
    rise[c] = whole_steps(s, "rise_delay", s.rise_delay_s, dt, nearest);
    fall[c] = whole_steps(s, "fall_delay", s.fall_delay_s, dt, nearest);
    dwell[c] = whole_steps(s, "min_dwell", s.min_dwell_s, dt, at_least);
    min_on[c] = whole_steps(s, "min_on", s.min_on_s, dt, at_least);
    min_off[c] = whole_steps(s, "min_off", s.min_off_s, dt, at_least);
    longest_delay = std::max({longest_delay, rise[c], fall[c]});
  }
  take_windows(modes, dt);
  groups = modes.one_at_a_time().size();
  std::ranges::copy(modes.one_at_a_time(), group.begin());
}

void SwitchTiming::take_windows(const ModeSet& modes, double dt) {
  std::size_t counted = 0;
  for (std::size_t c = 0; c < modes.switches().size(); ++c) {
    const Switch& s = modes.switches()[c];
    if (s.max_changes == 0) continue;
    const double steps = std::ceil(s.window_s / dt - whole);
    if (!(s.max_changes > 0 && steps >= 1 && steps < DelayLines::max_age))
      require(false, fmt::format("switch '{}': {} changes in {} s, {} steps of {} s (allowed: 1 and more in 1 to {})",
                                 s.name, s.max_changes, s.window_s, steps, dt, DelayLines::max_age - 1));
    counted += static_cast<std::size_t>(s.max_changes);
    max_changes[c] = s.max_changes;
    window[c] = static_cast<int>(steps);
    windowed |= SwitchPattern{1} << c;
  }
  if (counted > max_window_changes)
    require(false, fmt::format("mode set '{}': windows of {} changes of all switches together (allowed: {})",
                               modes.name(), counted, max_window_changes));
}

std::vector<int> SwitchTiming::edges() const {
  std::vector<int> all = {0};
  for (std::size_t c = 0; c < static_cast<std::size_t>(switches); ++c) all.insert(all.end(), {rise[c], fall[c]});
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

int SwitchTiming::longest_dwell() const {
  return std::max({std::ranges::max(dwell), std::ranges::max(min_on), std::ranges::max(min_off)});
}

std::vector<std::string> rounded_times(const ModeSet& modes, double dt) {
  const SwitchTiming timing(modes, dt);
  std::vector<std::string> lines;
  for (std::size_t c = 0; c < modes.switches().size(); ++c) {
    const Switch& s = modes.switches()[c];
    const auto note = [&](const char* what, double time_s, int steps) {
      if (std::abs(time_s / dt - steps) <= whole) return;
      lines.push_back(fmt::format("switch '{}': {} of {:g} ms is {} steps of {:g} ms", s.name, what, 1e3 * time_s,
                                  steps, 1e3 * dt));
    };
    note("rise_delay", s.rise_delay_s, timing.rise[c]);
    note("fall_delay", s.fall_delay_s, timing.fall[c]);
    note("min_dwell", s.min_dwell_s, timing.dwell[c]);
    note("min_on", s.min_on_s, timing.min_on[c]);
    note("min_off", s.min_off_s, timing.min_off[c]);
    if (s.max_changes > 0) note("window", s.window_s, timing.window[c]);
  }
  return lines;
}

DelayLines DelayLines::restored(SwitchPattern commanded, std::span<const Line> lines, std::span<const Change> changes) {
  DelayLines restored(commanded);
  for (std::size_t c = 0; c < lines.size() && c < max_switches; ++c) {
    restored.keep(c, lines[c].states, (commanded >> c) & 1u);
    restored.changed_at_[c] = -lines[c].age;
  }
  for (const Change& change : changes.first(std::min(changes.size(), max_window_changes))) {
    restored.change_at_[restored.changes_] = -change.age;
    restored.change_switch_[restored.changes_++] = static_cast<std::uint8_t>(change.c);
  }
  return restored;
}

int DelayLines::settled_after() const {
  int settled = 0;
  for (SwitchPattern left = moving_; left != 0; left &= left - 1) {
    const std::int64_t line = line_[static_cast<std::size_t>(std::countr_zero(left))];
    // Bits that differ from the final one: the highest of them is the last step before the switch settles.
    const auto differing = static_cast<std::uint64_t>(line < 0 ? ~line : line);
    settled = std::max(settled, 64 - std::countl_zero(differing));
  }
  return settled;
}

bool DelayLines::operator==(const DelayLines& other) const {
  if (commanded_ != other.commanded_ || moving_ != other.moving_) return false;
  for (std::size_t c = 0; c < max_switches; ++c)
    if (states(c) != other.states(c) || age(c) != other.age(c)) return false;
  if (changes_ != other.changes_) return false;
  for (std::size_t i = 0; i < changes_; ++i)
    if (change(i).c != other.change(i).c || change(i).age != other.change(i).age) return false;
  return true;
}

int DelayLines::changes_within(std::size_t c, int window) const {
  int count = 0;
  for (std::size_t i = 0; i < changes_; ++i) count += change_switch_[i] == c && age_of(change_at_[i]) < window;
  return count;
}

bool DelayLines::within_windows(SwitchPattern changed, const SwitchTiming& timing) const {
  for (; changed != 0; changed &= changed - 1) {
    const auto c = static_cast<std::size_t>(std::countr_zero(changed));
    if (changes_within(c, timing.window[c]) >= timing.max_changes[c]) return false;
  }
  return true;
}

BrokenLimit DelayLines::broken_by(SwitchPattern pattern, const SwitchTiming& timing) const {
  using Kind = BrokenLimit::Kind;
  const SwitchPattern changed = pattern ^ commanded_;
  for (int c = 0; c < timing.switches; ++c) {
    const auto at = static_cast<std::size_t>(c);
    const int least = timing.least(at, (commanded_ >> c) & 1u);
    if (((changed >> c) & 1u) != 0 && age(at) < least)
      return {Kind::dwell, 0, c, static_cast<double>(age(at)), static_cast<double>(least)};
  }
  for (int c = 0; c < timing.switches; ++c) {
    const auto at = static_cast<std::size_t>(c);
    const int changes = changes_within(at, timing.window[at]);
    if (((changed & timing.windowed) >> c & 1u) != 0 && changes >= timing.max_changes[at])
      return {Kind::window, 0, c, static_cast<double>(changes), static_cast<double>(timing.max_changes[at])};
  }
  for (std::size_t g = 0; g < timing.groups; ++g)
    if (!one_at_a_time(changed, std::span(&timing.group[g], 1)))
      return {Kind::one_at_a_time, 0, static_cast<int>(g), 2.0, 1.0};
  return {};
}

/// What no window counts any more makes room first; where commands did not keep to the windows, the oldest.
void DelayLines::remember_change(std::size_t c, const SwitchTiming& timing) {
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < changes_; ++i) {
    if (age_of(change_at_[i]) >= timing.window[change_switch_[i]]) continue;
    change_at_[kept] = change_at_[i];
    change_switch_[kept++] = change_switch_[i];
  }
  if (kept == max_window_changes) {
    std::shift_left(change_at_.begin(), change_at_.end(), 1);
    std::shift_left(change_switch_.begin(), change_switch_.end(), 1);
    --kept;
  }
  change_at_[kept] = now_;
  change_switch_[kept] = static_cast<std::uint8_t>(c);
  changes_ = kept + 1;
}

void DelayLines::forget_ages() {
  for (int& at : changed_at_) at = std::max(at - now_, -max_age);
  for (int& at : change_at_) at = std::max(at - now_, -max_age);
  now_ = 0;
}

}  // namespace solenoid
