#pragma once

#include "core/mpc/mode_set.hpp"
#include "core/mpc/relaxation.hpp"

#include <array>
#include <limits>

namespace solenoid {

/// Relaxed switch states as pulses at the ticks of a control period.                      [theory-relaxed.md, sect. 6]
///
/// Each period every switch tries all 2^5 commands for its ticks, held after them for another period, through its own
/// delays and the edges in flight, and takes the one whose effective on-time follows the wanted one best: least sum
/// of squares of the cumulative error, what earlier periods left over included, then fewest edges. Delays are thus
/// made up for as far as pulses of whole ticks can: with 4 ms to rise, 1 ms to fall and a period of 5 ms a single
/// pulse a period realises 0, 1 or 5 ticks, and the remainder is carried over.
class PulseWidth {
 public:
  static constexpr int ticks = 5, ahead = 2 * ticks;
  /// Wanted effective states of the coming two periods, tick by tick.
  using Wanted = std::array<SwitchStates<double>, ahead>;

  PulseWidth(const ModeSet& modes, double tick_s) : modes_(modes), timing_(modes, tick_s) {}

  /// Plans the coming period for the commands in flight.
  void plan(const Wanted& wanted, const SwitchLines& lines) noexcept {
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c) choose(c, wanted, lines);
    wanted_ = wanted;
  }

  /// The pattern to command at tick i of the period; allowed, where two switches exclude each other the one that is
  /// wanted less stays off.
  SwitchPattern command(int i) const noexcept {
    SwitchPattern pattern = 0;
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c)
      pattern |= ((schedule_[c] >> i) & 1u) << c;
    while (pattern != 0 && modes_.find(pattern) < 0) pattern &= ~least_wanted(pattern);
    return pattern;
  }

  /// Counts what was in effect in tick i of the period.
  void applied(int i, SwitchPattern in_effect) noexcept {
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c) {
      left_over_[c] += wanted_[static_cast<std::size_t>(i)][c] - static_cast<double>((in_effect >> c) & 1u);
      left_over_[c] = std::clamp(left_over_[c], -2.0, 2.0);
    }
  }

 private:
  void choose(std::size_t c, const Wanted& wanted, const SwitchLines& lines) noexcept {
    double best = std::numeric_limits<double>::infinity();
    const SwitchPattern others = lines.commanded() & ~(SwitchPattern{1} << c);
    for (SwitchPattern schedule = 0; schedule < (1u << ticks); ++schedule) {
      SwitchLines trial = lines;
      SwitchPattern last = (lines.commanded() >> c) & 1u;
      double error = left_over_[c], sum = 0.0;
      for (int i = 0; i < ahead; ++i) {
        const SwitchPattern on = i < ticks ? (schedule >> i) & 1u : last;
        sum += on != last ? edge_price : 0.0;
        last = on;
        trial.command(others | (on << c), timing_);
        error += wanted[static_cast<std::size_t>(i)][c] - static_cast<double>((trial.effective() >> c) & 1u);
        sum += error * error;
        trial.advance(1);
      }
      if (sum < best) best = sum, schedule_[c] = schedule;
    }
  }
  SwitchPattern least_wanted(SwitchPattern among) const noexcept {
    SwitchPattern least = 0;
    double level = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c)
      if (((among >> c) & 1u) != 0 && left_over_[c] < level) level = left_over_[c], least = SwitchPattern{1} << c;
    return least;
  }

  static constexpr double edge_price = 0.05;  // in squared ticks: breaks ties, and no more
  const ModeSet modes_;
  SwitchTiming timing_;
  Wanted wanted_{};
  std::array<double, max_switches> left_over_{};
  std::array<SwitchPattern, max_switches> schedule_{};
};

}  // namespace solenoid
