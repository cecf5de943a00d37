#include "solvers/rounding/delta_sigma.hpp"

#include <limits>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double tie = 1e-9;  // in squared steps: no edge for what rounding makes of equal choices

}  // namespace

DeltaSigma::DeltaSigma(int order, double edge_price) : order_(order), edge_price_(std::max(tie, edge_price)) {
  if (order != 1 && order != 2)
    throw std::invalid_argument(fmt::format("delta-sigma: of order {} (allowed: 1, 2)", order));
}

void DeltaSigma::prepare(const ModeSet&, const SwitchTiming& timing, const RelaxedGrid& grid) {
  timing_ = timing;
  wanted_.prepare(timing, grid);
  for (std::size_t c = 0; c < static_cast<std::size_t>(timing.switches); ++c) {
    const int pulse = least_in_effect(timing, c, true), pause = least_in_effect(timing, c, false);
    const int longest = std::max(pulse, pause);
    ahead_[c] = std::max(timing.rise[c] + pulse, timing.fall[c] + pause);
    // Of first order half of the longest pulse or pause and a step, of second order half a step more, and what has to
    // be owed before a change is worth its price. The sum as without delays at a duty of 0.1; through delays less, for
    // a loop that plans anew from what is measured works it off too.
    most_.owed[c] = 0.5 * longest + (order_ == 1 ? 1.0 : 1.5) + 0.5 * edge_price_;
    most_.owed_sum[c] = order_ == 1 ? 0.0 : 4.0 / longest;
  }
}

void DeltaSigma::round(const ModeSet& modes, const DelayLines& lines, std::span<const double> weights,
                       const ModulatorState& at_begin, std::span<int> mode, std::span<SwitchStates<double>> owed,
                       std::span<SwitchStates<double>> owed_sum) noexcept {
  wanted_.read(modes, lines, weights);
  ModulatedSteps steps(modes, timing_, lines, at_begin);
  for (std::size_t j = 0; j < wanted_.steps(); ++j) {
    owed[j] = steps.state.owed, owed_sum[j] = steps.state.owed_sum;
    SwitchPattern wished = steps.lines.commanded();
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c)
      if (changes(c, j, steps)) wished ^= SwitchPattern{1} << c;
    mode[j] = steps.command(wished);
    steps.pass(wanted_.at(j), most_);
  }
}

/// Whether switch c is to be commanded otherwise in this step.
bool DeltaSigma::changes(std::size_t c, std::size_t step, const ModulatedSteps& steps) const noexcept {
  const DelayLines::Line line = steps.lines.line(c);
  const bool on = (steps.lines.commanded() >> c) & 1u;
  if (line.age < timing_.least(c, on)) return false;
  const DelayLines::Line changed = {DelayLines::after_edge(line.states, !on, on ? timing_.fall[c] : timing_.rise[c]),
                                    0};
  const double stays = followed(c, step, line, on, steps, std::numeric_limits<double>::infinity());
  return followed(c, step, changed, !on, steps, stays - edge_price_) < stays - edge_price_;
}

/// The least sum of squares from a step on with this command and one further change, or none; any number beyond `best`
/// if there is none below.
double DeltaSigma::followed(std::size_t c, std::size_t step, DelayLines::Line line, bool on,
                            const ModulatedSteps& steps, double best) const noexcept {
  const int ahead = ahead_[c], delay = on ? timing_.fall[c] : timing_.rise[c];
  for (int again = std::max(1, timing_.least(c, on) - line.age); again <= ahead; ++again) {
    std::int64_t states = line.states;
    double owed = steps.state.owed[c], owed_sum = steps.state.owed_sum[c];
    double squares = again + delay < ahead ? edge_price_ : 0.0;
    for (int i = 0; i < ahead && squares < best; ++i, states >>= 1) {
      if (i == again) states = DelayLines::after_edge(states, !on, delay);
      owed += wanted_.at(step + static_cast<std::size_t>(i))[c] - static_cast<double>(states & 1);
      owed_sum += owed;
      squares += order_ == 1 ? owed * owed : owed_sum * owed_sum;
    }
    best = std::min(best, squares);
    if (again + delay >= ahead) break;  // too late to be felt
  }
  return best;
}

}  // namespace solenoid
