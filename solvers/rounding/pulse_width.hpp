#pragma once

#include "core/mpc/relaxation.hpp"

#include <array>
#include <span>
#include <vector>

namespace solenoid {

/// Relaxed switch states as pulses of whole steps.                                       [theory-relaxed.md, sect. 6]
///
/// Interval after interval, every switch tries all 2^n commands for the interval's n steps, held after them for another
/// interval, through its own delays, dwell and the edges in flight, and takes the one whose effective on-time follows
/// the wanted one best: least sum of squares of the cumulative error, what was owed before included, then fewest edges.
/// Delays are thus made up for as far as pulses of whole steps can: with 4 steps to rise, 1 to fall and an interval of
/// 5 a single pulse an interval realises 0, 1 or 5 steps, and the remainder is owed to the next.
class PulseWidth {
 public:
  /// 2^n commands are tried for each switch and interval.
  static constexpr int longest_interval = 12;

  /// May allocate; throws std::invalid_argument for intervals beyond longest_interval.
  void prepare(const ModeSet& modes, const SwitchTiming& timing, const RelaxedGrid& grid);

  /// shapes   weights: intervals x modes    owed_at_begin: one number a switch
  ///          modes, owed: one a step of the horizon; owed[j] as step j begins, after the commands before it
  /// Two switches that exclude each other are never on together: the one that is owed less stays off.
  void round(const ModeSet& modes, const DelayLines& lines, std::span<const double> weights,
             const SwitchStates<double>& owed_at_begin, std::span<int> mode,
             std::span<SwitchStates<double>> owed) noexcept;

 private:
  using Wanted = std::array<SwitchStates<double>, 2 * longest_interval>;

  void want(const ModeSet& modes, const DelayLines& lines, std::span<const double> weights, std::size_t k) noexcept;
  void choose(std::size_t c, std::size_t k, DelayLines::Line line, bool on, double owed) noexcept;
  SwitchPattern allowed(const ModeSet& modes, const DelayLines& lines, int i,
                        const SwitchStates<double>& owed) const noexcept;
  SwitchPattern one_change_a_group(const ModeSet& modes, SwitchPattern pattern, SwitchPattern before,
                                   const SwitchStates<double>& owed) const noexcept;

  SwitchTiming timing_;
  std::vector<int> intervals_;
  SwitchStates<double> before_{};                       // commanded in the interval before the one at hand
  Wanted wanted_{};                                     // effective states of the interval at hand and the next
  std::array<std::uint32_t, max_switches> schedule_{};  // bit i: on in step i of the interval
};

}  // namespace solenoid
