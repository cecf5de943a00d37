#pragma once

#include "core/mpc/relaxation.hpp"

#include <algorithm>
#include <span>
#include <vector>

namespace solenoid {

struct LinearPlant;

/// What a modulator carries from one plan to the next, an entry a switch.
struct ModulatorState {
  SwitchStates<double> owed{};      ///< steps for which it has been on for less than wanted
  SwitchStates<double> owed_sum{};  ///< the sum of that over the steps before
};

/// Relaxed switch states as commands of single steps, each of them a mode.                [theory-relaxed.md, sect. 6]
///
/// Commands keep to the modes, to groups, dwells and windows (DelayLines::may_command); where none of the modes that a
/// modulator would like may be commanded, the one in force goes on.
class Modulator {
 public:
  virtual ~Modulator() = default;

  /// For problems with this mode set, its timing and this grid. May allocate; throws std::invalid_argument for what the
  /// modulator cannot do.
  virtual void prepare(const ModeSet& modes, const SwitchTiming& timing, const RelaxedGrid& grid) = 0;

  /// shapes   weights: intervals x modes    mode, owed, owed_sum: one a step of the grid; the last two as the step
  ///          begins, after the commands before it
  /// The same arguments give the same modes, whatever was rounded before. No allocation.
  virtual void round(const ModeSet& modes, const DelayLines& lines, std::span<const double> weights,
                     const ModulatorState& at_begin, std::span<int> mode, std::span<SwitchStates<double>> owed,
                     std::span<SwitchStates<double>> owed_sum) noexcept = 0;

  /// What the modulator has to know of the plant before it rounds (linear_plant.hpp); none: nothing.
  virtual LinearPlant* plant() noexcept { return nullptr; }
};

/// Switch states in effect at each step of a grid, as the relaxed prediction has them: after the commands in flight in
/// the first interval, after the interval before in the others.
class WantedStates {
 public:
  /// May allocate.
  void prepare(const SwitchTiming& timing, const RelaxedGrid& grid);
  /// From the weights, intervals x modes, of a problem that begins with these commands in flight.
  void read(const ModeSet& modes, const DelayLines& lines, std::span<const double> weights) noexcept;
  /// Those of one step; beyond the last, those of the last.
  const SwitchStates<double>& at(std::size_t step) const noexcept {
    return states_[std::min(step, states_.size() - 1)];
  }
  /// The steps of the grid.
  std::size_t steps() const noexcept { return states_.size(); }

 private:
  SwitchTiming timing_;
  std::vector<int> intervals_;
  std::vector<SwitchStates<double>> states_;
};

/// Steps for which a switch that goes on (off) is so in effect at least.
int least_in_effect(const SwitchTiming& timing, std::size_t c, bool on) noexcept;

/// The pattern nearest to a wished one that may be commanded now: of switches that exclude each other those that are
/// owed least stay off, of a group the change that is owed most is made; the pattern in force where dwells or windows
/// forbid the result.
SwitchPattern allowed_pattern(const ModeSet& modes, const SwitchTiming& timing, const DelayLines& lines,
                              SwitchPattern wished, const SwitchStates<double>& owed) noexcept;

/// A rounding under way, step after step.
struct ModulatedSteps {
  const ModeSet& modes;
  const SwitchTiming& timing;
  DelayLines lines;
  ModulatorState state;
  int mode;  ///< commanded last; the first of the set where that is none of it

  /// As a problem begins.
  ModulatedSteps(const ModeSet& mode_set, const SwitchTiming& steps, const DelayLines& in_flight,
                 const ModulatorState& at_begin)
      : modes(mode_set),
        timing(steps),
        lines(in_flight),
        state(at_begin),
        mode(std::max(0, mode_set.find(in_flight.commanded()))) {}

  /// Commands what is allowed of a wished pattern, and gives its mode.
  int command(SwitchPattern wished) noexcept;
  /// Lets the step pass: what is in effect less than wanted is owed, at most so much of each switch.
  void pass(const SwitchStates<double>& wanted, const ModulatorState& most) noexcept;
};

}  // namespace solenoid
