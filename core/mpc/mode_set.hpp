#pragma once

#include "core/mpc/broken_limit.hpp"
#include "core/mpc/scalar.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace solenoid {

/// The on/off state of every switch, one bit each: bit c is switch c.
using SwitchPattern = std::uint32_t;

/// Switches (coils) a ModeSet may have.
inline constexpr std::size_t max_switches = 32;
/// Switched inputs of a model that a ModeSet may map to.
inline constexpr std::size_t max_switched = 32;
/// Longest delay or dwell of a switch, in model steps.
inline constexpr int max_delay_steps = 62;
/// Changes of all switches together whose moments are remembered for windows.
inline constexpr std::size_t max_window_changes = 64;

/// The switches from 0 on, `count` of them.
constexpr SwitchPattern first_switches(std::size_t count) {
  return count == 0 ? 0 : ~SwitchPattern{0} >> (max_switches - count);
}

/// Switch states, commanded or in effect, as real numbers; entries beyond the mode set's switches stay 0.
template <class Scalar>
using SwitchStates = Vector<Scalar, max_switches>;

/// A binary switch and its timing: a commanded rising (falling) edge takes effect rise_delay_s (fall_delay_s) later,
/// and the command may change again only min_dwell_s after its last change, off again only min_on_s after it went on and
/// on again only min_off_s after it went off. Within any window_s its command changes at most max_changes times.
struct Switch {
  std::string name;
  double rise_delay_s = 0.0;
  double fall_delay_s = 0.0;
  double min_dwell_s = 0.0;
  double min_on_s = 0.0, min_off_s = 0.0;
  int max_changes = 0;  ///< 0: as many as dwells allow
  double window_s = 0.0;
};

/// An allowed pattern, by name.
struct Mode {
  std::string name;
  SwitchPattern pattern = 0;
};

/// A model's switched inputs at a pattern: as many numbers as the mode set says, at most max_switched.
class SwitchedPoint {
 public:
  using value_type = double;
  using const_iterator = const double*;

  const double* begin() const { return value_.data(); }
  const double* end() const { return value_.data() + size_; }
  std::size_t size() const { return size_; }
  double operator[](std::size_t i) const { return value_[i]; }

 private:
  friend class ModeSet;
  std::array<double, max_switched> value_;
  std::size_t size_ = 0;
};

/// The finite set of switch patterns that may be commanded, and the affine map from switch states b to the model's
/// switched inputs: s = offset + sum_c gain[c] b_c. The map is defined for every pattern, commanded or only passed
/// through while edges are in flight. Pure data, immutable once built.
///
/// One pattern is safe: switches stand at it before the first command, and wherever no other may be commanded.
///
/// Switches can be grouped: of a group, a mask of switches, at most one changes with one command. (A phase of a
/// phase with three levels goes from + to - by way of 0.)
class ModeSet {
 public:
  /// gain[c] and offset have the model's switched_size entries. `safe` is one of the modes; if it is not said, every
  /// switch off, or where that is no mode the first. Throws std::invalid_argument, naming what is wrong.
  ModeSet(std::string name, std::vector<Switch> switches, std::vector<Mode> modes, std::vector<double> offset,
          std::vector<std::vector<double>> gain, std::vector<SwitchPattern> one_at_a_time = {},
          std::optional<SwitchPattern> safe = {});

  /// Its name, as variants choose it.
  const std::string& name() const { return name_; }
  /// How many switches there are.
  int switch_count() const { return static_cast<int>(switches_.size()); }
  /// How many modes there are.
  int size() const { return static_cast<int>(modes_.size()); }
  /// The switches; bit c of a pattern is switches()[c].
  std::span<const Switch> switches() const { return switches_; }
  /// The patterns that may be commanded; a plan's numbers are indices into this.
  std::span<const Mode> modes() const { return modes_; }
  /// The groups of switches of which at most one changes with one command; at most max_switches of them.
  std::span<const SwitchPattern> one_at_a_time() const { return one_at_a_time_; }
  /// The pattern that mode `mode` commands.
  SwitchPattern pattern(int mode) const { return modes_[static_cast<std::size_t>(mode)].pattern; }
  /// The pattern that is safe.
  SwitchPattern safe_pattern() const { return safe_; }
  /// How many switched inputs the model has.
  std::size_t switched_size() const { return offset_.size(); }
  /// The switched inputs with every switch off; switched_size() numbers.
  std::span<const double> offset() const { return offset_; }
  /// What switch c adds to them when it is on; switched_size() numbers.
  std::span<const double> gain(std::size_t c) const { return gain_[c]; }
  /// The model's switched inputs at any pattern; switched_size() numbers.
  SwitchedPoint point(SwitchPattern pattern) const {
    SwitchedPoint at;
    at.size_ = offset_.size();
    write_point(pattern, at.size_, at.value_.data());
    return at;
  }
  /// The same for a model that has `size` of them, switched_size().
  template <std::size_t size>
  Vector<double, size> inputs(SwitchPattern pattern) const {
    Vector<double, size> at;
    write_point(pattern, size, at.data());
    return at;
  }
  /// The switches that lower switched input i when they go on.
  SwitchPattern lowering(std::size_t i) const { return lowering_[i]; }
  /// The mode that commands `pattern`, or -1.
  int find(SwitchPattern pattern) const;
  /// The same modes with other switches' timing: one a switch. Throws as the constructor does.
  ModeSet with_switches(std::vector<Switch> switches) const;
  /// The same modes with every delay multiplied by factor >= 0 (a plant whose switches are slower than believed).
  ModeSet with_delays_scaled(double factor) const;

 private:
  std::string name_;
  std::vector<Switch> switches_;
  std::vector<Mode> modes_;
  std::vector<double> offset_;
  std::vector<std::vector<double>> gain_;
  std::vector<SwitchPattern> one_at_a_time_;
  SwitchPattern safe_ = 0;
  static constexpr std::size_t chunk = 8;  // switches whose sums are looked up together

  /// offset + the sum over the switches that are on, in their order within each chunk of them, then over the chunks.
  void write_point(SwitchPattern pattern, std::size_t size, double* into) const {
    const SwitchPattern in_chunk = chunk_patterns_ - 1;
    const double* sums = sums_.data();
    std::copy_n(sums + (pattern & in_chunk) * size, size, into);
    for (SwitchPattern rest = pattern >> chunk; rest != 0; rest >>= chunk) {
      sums += chunk_patterns_ * size;
      for (std::size_t i = 0; i < size; ++i) into[i] += sums[(rest & in_chunk) * size + i];
    }
  }
  void tabulate();

  std::vector<double> sums_;  // of each pattern of a chunk, switched_size numbers; of the first with the offset
  SwitchPattern chunk_patterns_ = 1;
  std::vector<SwitchPattern> lowering_;                    // of each switched input
  std::vector<std::pair<SwitchPattern, int>> by_pattern_;  // the modes, ascending
};

/// Whether a command that changes the switches `changed` keeps to groups of which one may change at a time.
constexpr bool one_at_a_time(SwitchPattern changed, std::span<const SwitchPattern> groups) {
  for (const SwitchPattern group : groups) {
    const SwitchPattern inside = changed & group;
    if ((inside & (inside - 1)) != 0) return false;
  }
  return true;
}

/// What a ModeSet asks of commands. Its timing is in steps of dt: delays rounded to the nearest step, least dwells up,
/// so that one is never shorter than asked.
struct SwitchTiming {
  SwitchTiming() = default;
  /// Throws std::invalid_argument beyond max_delay_steps, and for windows with more changes than max_window_changes.
  SwitchTiming(const ModeSet& modes, double dt);
  /// How long switch c has to stay as it is, once it has been commanded on or off.
  int least(std::size_t c, bool on) const { return std::max(dwell[c], on ? min_on[c] : min_off[c]); }
  /// The longest of these times.
  int longest_dwell() const;
  /// The steps after a command at which what is in effect can change for it: 0 and every delay, ascending. Allocates.
  std::vector<int> edges() const;
  int switches = 0;
  std::array<int, max_switches> rise{}, fall{}, dwell{}, min_on{}, min_off{};
  int longest_delay = 0;
  /// Of the switches `windowed` at most max_changes[c] commands may change within any window[c] steps.
  std::array<int, max_switches> max_changes{}, window{};
  SwitchPattern windowed = 0;
  /// Of each of the first `groups` masks at most one switch changes with one command.
  std::array<SwitchPattern, max_switches> group{};
  std::size_t groups = 0;

 private:
  void take_windows(const ModeSet& modes, double dt);
};

/// One line for each time of the mode set that is no whole number of steps: what was asked and what it became.
std::vector<std::string> rounded_times(const ModeSet& modes, double dt);

/// The commands in flight. For each switch a line of effective states: bit i is its state i steps from now, the last
/// bit its state from then on, which is what was commanded last. A command overwrites the line from its delay onwards; so
/// edges are delayed each on its own, and a pulse shorter than its delay is swallowed.
///
/// Most switches are at rest most of the time: only lines with an edge on its way are kept and moved.
class DelayLines {
 public:
  DelayLines() : DelayLines(0) {}
  /// Every switch settled at `pattern`, free to change.
  explicit DelayLines(SwitchPattern pattern) : commanded_(pattern) { changed_at_.fill(-max_age); }

  /// Commands a pattern now: switches that differ from the last command change after their delays.
  void command(SwitchPattern pattern, const SwitchTiming& timing) {
    for (SwitchPattern changed = pattern ^ commanded_; changed != 0; changed &= changed - 1) {
      const SwitchPattern one = changed & (~changed + 1);
      const auto c = static_cast<std::size_t>(std::countr_zero(changed));
      const bool on = (pattern & one) != 0;
      keep(c, after_edge(states(c), on, on ? timing.rise[c] : timing.fall[c]), on);
      changed_at_[c] = now_;
      if ((timing.windowed & one) != 0) remember_change(c, timing);
    }
    commanded_ = pattern;
  }
  /// A switch's line of effective states once it has been commanded on or off, `delay` steps before that takes effect.
  static std::int64_t after_edge(std::int64_t states, bool on, int delay) {
    const std::int64_t from = -(std::int64_t{1} << delay);
    return on ? (states | from) : (states & ~from);
  }
  /// The pattern in effect `ahead` steps from now.
  SwitchPattern effective(int ahead = 0) const {
    const int bit = ahead < 63 ? ahead : 63;
    SwitchPattern pattern = commanded_ & ~moving_;
    for (SwitchPattern left = moving_; left != 0; left &= left - 1) {
      const auto c = static_cast<std::size_t>(std::countr_zero(left));
      pattern |= static_cast<SwitchPattern>((line_[c] >> bit) & 1) << c;
    }
    return pattern;
  }
  /// Lets time pass.
  void advance(int steps) {
    const int shift = steps < 63 ? steps : 63;
    for (SwitchPattern left = moving_; left != 0; left &= left - 1) {
      const auto c = static_cast<std::size_t>(std::countr_zero(left));
      keep(c, line_[c] >> shift, (commanded_ >> c) & 1u);
    }
    now_ += steps < max_age ? steps : max_age;
    if (now_ >= max_age) forget_ages();
  }
  /// Whether every switch that would change has dwelt long enough and changed seldom enough, and no other of its groups
  /// would change with it.
  bool may_command(SwitchPattern pattern, const SwitchTiming& timing) const {
    const SwitchPattern changed = pattern ^ commanded_;
    if (!one_at_a_time(changed, std::span(timing.group.data(), timing.groups))) return false;
    for (SwitchPattern left = changed; left != 0; left &= left - 1) {
      const auto c = static_cast<std::size_t>(std::countr_zero(left));
      if (age(c) < timing.least(c, (commanded_ >> c) & 1u)) return false;
    }
    return (changed & timing.windowed) == 0 || within_windows(changed & timing.windowed, timing);
  }
  /// Which of these a command of `pattern` would break first, its step left at 0.
  BrokenLimit broken_by(SwitchPattern pattern, const SwitchTiming& timing) const;
  /// Steps from now after which no switch changes on its own any more.
  int settled_after() const;
  /// The pattern commanded last.
  SwitchPattern commanded() const { return commanded_; }
  /// How often the command of switch c, which has a window, has changed in the last `window` steps.
  int changes_within(std::size_t c, int window) const;

  /// One switch as it is kept: its line of effective states and the steps since its command last changed.
  struct Line {
    std::int64_t states = 0;
    int age = max_age;
  };
  /// The line of switch c, for a record.
  Line line(std::size_t c) const { return {states(c), age(c)}; }
  /// A change that a window still counts: of which switch, how many steps ago.
  struct Change {
    std::size_t c = 0;
    int age = 0;
  };
  /// How many of them are remembered, and the i-th, oldest first.
  std::size_t changes() const { return changes_; }
  Change change(std::size_t i) const { return {change_switch_[i], age_of(change_at_[i])}; }  ///< the i-th
  /// The lines of a record: line(c) gives `lines`[c], every further switch is off and free to change; then what windows
  /// count.
  static DelayLines restored(SwitchPattern commanded, std::span<const Line> lines,
                             std::span<const Change> changes = {});
  /// Beyond this an age says no more.
  static constexpr int max_age = 1 << 20;

  bool operator==(const DelayLines& other) const;

 private:
  std::int64_t states(std::size_t c) const {
    return (moving_ >> c) & 1u ? line_[c] : -static_cast<std::int64_t>((commanded_ >> c) & 1u);
  }
  int age_of(int at) const { return std::min(now_ - at, max_age); }
  int age(std::size_t c) const { return age_of(changed_at_[c]); }
  bool within_windows(SwitchPattern changed, const SwitchTiming& timing) const;
  void remember_change(std::size_t c, const SwitchTiming& timing);
  /// Keeps a line that ends `on`, if there is an edge on it.
  void keep(std::size_t c, std::int64_t states, bool on) {
    line_[c] = states;
    const SwitchPattern one = SwitchPattern{1} << c;
    moving_ = states == -static_cast<std::int64_t>(on) ? moving_ & ~one : moving_ | one;
  }
  void forget_ages();

  SwitchPattern commanded_ = 0;
  SwitchPattern moving_ = 0;                       // switches with an edge on its way
  int now_ = 0;                                    // in [0, max_age)
  std::array<int, max_switches> changed_at_;       // of each command's last change, at least -max_age
  std::array<std::int64_t, max_switches> line_{};  // of those that move; the others are of no use
  std::uint32_t changes_ = 0;                      // remembered for windows, oldest first
  std::array<int, max_window_changes> change_at_{};
  std::array<std::uint8_t, max_window_changes> change_switch_{};
};

}  // namespace solenoid
