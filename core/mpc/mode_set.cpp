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

void check_modes(const std::string& set, std::size_t switches, const std::vector<Mode>& modes) {
  require(!modes.empty(), fmt::format("mode set '{}': needs at least one mode", set));
  for (std::size_t i = 0; i < modes.size(); ++i) {
    require(
        modes[i].pattern < (1u << switches),
        fmt::format("mode set '{}': mode '{}' uses a switch beyond the {} there are", set, modes[i].name, switches));
    for (std::size_t j = 0; j < i; ++j)
      require(
          modes[i].pattern != modes[j].pattern,
          fmt::format("mode set '{}': modes '{}' and '{}' are the same pattern", set, modes[j].name, modes[i].name));
  }
}

void check_groups(const std::string& set, std::size_t switches, const std::vector<SwitchPattern>& groups) {
  require(groups.size() <= max_switches,
          fmt::format("mode set '{}': {} groups of switches; at most {}", set, groups.size(), max_switches));
  for (const SwitchPattern group : groups) {
    require(group < (1u << switches),
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
    require(false, fmt::format("switch '{}': {} of {} s is {} steps of {} s; allowed 0 to {}", s.name, what, time_s,
                               steps, dt, max_delay_steps));
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
      one_at_a_time_(std::move(one_at_a_time)) {
  require(switches_.size() <= max_switches,
          fmt::format("mode set '{}': {} switches; at most {}", name_, switches_.size(), max_switches));
  require(gain.size() == switches_.size(), fmt::format("mode set '{}': one gain column a switch", name_));
  check_modes(name_, switches_.size(), modes_);
  check_groups(name_, switches_.size(), one_at_a_time_);
  safe_ = safe.value_or(find(0) >= 0 ? SwitchPattern{0} : pattern(0));
  require(find(safe_) >= 0, fmt::format("mode set '{}': the safe pattern {:b} is no mode", name_, safe_));
  const std::size_t patterns = std::size_t{1} << switches_.size();
  points_.reserve(patterns * offset_.size());
  for (std::size_t pattern = 0; pattern < patterns; ++pattern) {
    for (std::size_t row = 0; row < offset_.size(); ++row) {
      double value = offset_[row];
      for (std::size_t c = 0; c < gain.size(); ++c) {
        require(gain[c].size() == offset_.size(), fmt::format("mode set '{}': gain of switch '{}' needs {} entries",
                                                              name_, switches_[c].name, offset_.size()));
        if ((pattern >> c) & 1u) value += gain[c][row];
      }
      points_.push_back(value);
    }
  }
}

std::span<const double> ModeSet::point(SwitchPattern pattern) const {
  return std::span(points_).subspan(pattern * offset_.size(), offset_.size());
}

int ModeSet::find(SwitchPattern pattern) const {
  for (int mode = 0; mode < size(); ++mode)
    if (this->pattern(mode) == pattern) return mode;
  return -1;
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
    longest_delay = std::max({longest_delay, rise[c], fall[c]});
  }
  groups = modes.one_at_a_time().size();
  std::ranges::copy(modes.one_at_a_time(), group.begin());
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
  }
  return lines;
}

DelayLines::DelayLines(SwitchPattern pattern) : commanded_(pattern) {
  for (std::size_t c = 0; c < max_switches; ++c) line_[c] = ((pattern >> c) & 1u) ? -1 : 0;
}

DelayLines DelayLines::restored(SwitchPattern commanded, std::span<const Line> lines) {
  DelayLines restored;
  restored.commanded_ = commanded;
  for (std::size_t c = 0; c < lines.size() && c < max_switches; ++c) {
    restored.line_[c] = lines[c].states;
    restored.age_[c] = lines[c].age;
  }
  return restored;
}

int DelayLines::settled_after() const {
  int settled = 0;
  for (const std::int64_t line : line_) {
    // Bits that differ from the final one: the highest of them is the last step before the switch settles.
    const auto differing = static_cast<std::uint64_t>(line < 0 ? ~line : line);
    settled = std::max(settled, 64 - std::countl_zero(differing));
  }
  return settled;
}

}  // namespace solenoid
