#pragma once

#include "solvers/rounding/modulator.hpp"

#include <array>
#include <span>
#include <vector>

namespace solenoid {

/// Relaxed switch states as single steps by delta-sigma modulators, one a switch.          [theory-relaxed.md, sect. 6]
///
/// With w what is wanted in effect at step j and y what is,
///
///     first order    s_j = s_{j-1} + w_j - y_j                                 y = w + (1 - z^-1) e,    e = -s
///     second order   s_j as before,  t_j = t_{j-1} + s_j                       y = w + (1 - z^-1)^2 e,  e = -t
///
/// and each step the switch takes the state that leaves |s|, or |t|, the least: error feedback with a quantiser of one
/// bit. Without delays and dwells |s| <= 1/2 for any w in [0, 1], so that the mean over N steps is off by 1/(2N) at
/// most; t is bounded for w constant inside (0, 1).
///
/// A command acts after its switch's delay, and what takes it back acts later still: with 4 steps to rise and 1 to fall
/// a pause is at least 4 steps. Fed back as it is, what builds up until then makes the loop oscillate. So both choices,
/// to change now or to stay, are followed through the edges in flight until a change either way could have been taken
/// back, each with its best moment for one further change; the least sum of squares of s, or of t, has it. Without
/// delays and dwells that is one step, and the rule above.
///
/// S. R. Norsworthy, R. Schreier, G. C. Temes (editors), Delta-Sigma Data Converters, IEEE Press, 1997. For thrusters:
/// F. Stark, J. Middelberg, S. Vyas, arXiv 2603.19796.
class DeltaSigma final : public Modulator {
 public:
  /// order        1 or 2; throws std::invalid_argument for others
  /// edge_price   what a change has to gain in squares of s, or t: a hysteresis, which spares edges
  explicit DeltaSigma(int order, double edge_price = 0.0);

  void prepare(const ModeSet& modes, const SwitchTiming& timing, const RelaxedGrid& grid) override;
  void round(const ModeSet& modes, const DelayLines& lines, std::span<const double> weights,
             const ModulatorState& at_begin, std::span<int> mode, std::span<SwitchStates<double>> owed,
             std::span<SwitchStates<double>> owed_sum) noexcept override;

  /// Where the states are cut off, against wind-up where no command brings what is wanted.
  const ModulatorState& most() const { return most_; }

 private:
  bool changes(std::size_t c, std::size_t step, const ModulatedSteps& steps) const noexcept;
  double followed(std::size_t c, std::size_t step, DelayLines::Line line, bool on, const ModulatedSteps& steps,
                  double best) const noexcept;

  int order_;
  double edge_price_;
  std::array<int, max_switches> ahead_{};  // steps for which a choice is followed
  SwitchTiming timing_;
  WantedStates wanted_;
  ModulatorState most_;
};

}  // namespace solenoid
