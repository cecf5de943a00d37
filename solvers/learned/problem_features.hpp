#pragma once

#include "core/mpc/problem.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {

/// What a network is told of a problem from block `first_block` on, where x is the state and z its output:
///
///     x,  r - z as that block's first step ends and as each block ends,  set-point - z of the first step,  load,
///     of each switch: what is commanded, what is in effect in each of the steps that a command can take,
///     and, if the mode set has dwell times, how much of its own has passed
///
/// Differences are taken in double precision: where outputs are states, the features say nothing of where the motion
/// is but x itself. A problem that begins in block k of another has the features of that one from block k on.
template <HybridModel M>
class ProblemFeatures {
 public:
  /// For problems of this shape. Allocates.
  void prepare(const Problem<M>& problem, std::size_t first_block = 0) {
    const std::vector<int>& blocks = problem.horizon.blocks;
    const auto begin = blocks.begin() + static_cast<std::ptrdiff_t>(first_block);
    first_step_ = static_cast<std::size_t>(std::accumulate(blocks.begin(), begin, 0));
    rows_ = {first_step_};
    std::size_t step = first_step_;
    for (auto b = begin; b != blocks.end(); ++b) rows_.push_back((step += static_cast<std::size_t>(*b)) - 1);
    timing_ = SwitchTiming(problem.modes, problem.horizon.dt_s);
    dwells_ = timing_.longest_dwell() > 0;
    const auto switches = static_cast<std::size_t>(timing_.switches);
    const auto of_switch = static_cast<std::size_t>(1 + timing_.longest_delay + (dwells_ ? 1 : 0));
    size_ = M::state_size + M::output_size * (rows_.size() + (HasFeedback<M> ? 1 : 0)) + problem.sizes().load +
            switches * of_switch;
    layout_ = fmt::format("{} states, {} outputs{}, {} of load, {} switches of {} steps{}, blocks {} of {:g} ms",
                          M::state_size, M::output_size, HasFeedback<M> ? " and set-points" : "", problem.sizes().load,
                          switches, timing_.longest_delay, dwells_ ? " that dwell" : "",
                          fmt::join(begin, blocks.end(), "+"), 1e3 * problem.horizon.dt_s);
  }

  /// How many there are.
  std::size_t size() const { return size_; }
  /// What they are of: networks that were trained on features of another layout do not fit.
  const std::string& layout() const { return layout_; }

  /// shapes   into: size()
  void write(const Problem<M>& problem, const StateOf<M>& x, const DelayLines& lines,
             std::span<float> into) const noexcept {
    float* at = into.data();
    for (std::size_t i = 0; i < M::state_size; ++i) *at++ = static_cast<float>(x[i]);
    const OutputOf<M> z = problem.model.template output<double>(x);
    const auto apart = [&](const OutputOf<M>& wanted) {
      for (std::size_t i = 0; i < M::output_size; ++i) *at++ = static_cast<float>(wanted[i] - z[i]);
    };
    for (const std::size_t row : rows_) apart(problem.reference[row]);
    if constexpr (HasFeedback<M>) apart(problem.setpoint[first_step_]);
    if constexpr (HasLoad<M>)
      for (const double value : problem.model.load()) *at++ = static_cast<float>(value);
    at = write_bits(lines.commanded(), at);
    for (int t = 0; t < timing_.longest_delay; ++t) at = write_bits(lines.effective(t), at);
    if (dwells_) write_ages(lines, at);
  }

 private:
  float* write_bits(SwitchPattern pattern, float* at) const noexcept {
    for (int c = 0; c < timing_.switches; ++c) *at++ = static_cast<float>((pattern >> c) & 1u);
    return at;
  }
  void write_ages(const DelayLines& lines, float* at) const noexcept {
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c) {
      const int least = timing_.least(c, (lines.commanded() >> c) & 1u);
      *at++ = least == 0 ? 1.0f : std::min(1.0f, static_cast<float>(lines.line(c).age) / static_cast<float>(least));
    }
  }

  SwitchTiming timing_;
  bool dwells_ = false;
  std::size_t first_step_ = 0, size_ = 0;
  std::vector<std::size_t> rows_;  // of the reference
  std::string layout_;
};

/// The weights of a problem's cost, as part of a layout: a learned cost is of these.
template <HybridModel M>
std::string weights_text(const Problem<M>& problem) {
  const Cost<M>& c = problem.cost;
  return fmt::format("tracking {}, terminal {}, switching {}, consumption {}", fmt::join(c.tracking, " "),
                     fmt::join(c.terminal, " "), c.switching, c.consumption);
}

}  // namespace solenoid
