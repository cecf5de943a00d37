#pragma once

#include "solvers/rounding/modulator.hpp"

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
class PulseWidth final : public Modulator {
 public:
  /// 2^n commands are tried for each switch and interval.
  static constexpr int longest_interval = 12;

  /// edge_price   of each edge, in squared steps: breaks ties, and beyond that trades error for edges
  explicit PulseWidth(double edge_price = 0.05) : edge_price_(edge_price) {}

  /// May allocate; throws std::invalid_argument for intervals beyond longest_interval.
  void prepare(const ModeSet& modes, const SwitchTiming& timing, const RelaxedGrid& grid) override;

  /// Modulator::round() with one state: the sum is left at 0.
  void round(const ModeSet& modes, const DelayLines& lines, std::span<const double> weights,
             const ModulatorState& at_begin, std::span<int> mode, std::span<SwitchStates<double>> owed,
             std::span<SwitchStates<double>> owed_sum) noexcept override;
  /// The same without the sum.
  void round(const ModeSet& modes, const DelayLines& lines, std::span<const double> weights,
             const SwitchStates<double>& owed_at_begin, std::span<int> mode,
             std::span<SwitchStates<double>> owed) noexcept;

 private:
  void choose(std::size_t c, std::size_t k, std::size_t first, DelayLines::Line line, bool on, double owed) noexcept;
  SwitchPattern scheduled(int i) const noexcept;

  double edge_price_;
  SwitchTiming timing_;
  std::vector<int> intervals_;
  WantedStates wanted_;
  std::array<std::uint32_t, max_switches> schedule_{};  // bit i: on in step i of the interval
};

}  // namespace solenoid
