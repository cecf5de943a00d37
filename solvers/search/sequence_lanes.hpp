#pragma once

#include "core/mpc/plan.hpp"
#include "solvers/search/lane_inputs.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <numeric>
#include <vector>

namespace solenoid {

/// Whole sequences of modes rolled out beside each other, a SIMD lane a sequence. Their costs are those of evaluate() to the
/// last bit; a sequence that breaks a limit costs infinity.
/// promise  no allocation, lock or exception but in prepare()
template <HybridModel M>
class SequenceLanes {
 public:
  /// By this kernel.
  explicit SequenceLanes(const RolloutKernel<M>& kernel = rollout_kernel<M>()) : kernel_(kernel) {}

  /// Sizes everything for problems with this mode set and horizon. Allocates; throws std::invalid_argument as SwitchTiming
  /// does.
  void prepare(const Problem<M>& problem) {
    const std::vector<int>& blocks = problem.horizon.blocks;
    timing_ = SwitchTiming(problem.modes, problem.horizon.dt_s);
    builder_.prepare(problem.modes, timing_);
    inputs_.reserve(builder_.most_pieces());
    planned_.resize(problem.reference.size());
    settled_lines_.clear();
    for (const Mode& mode : problem.modes.modes()) settled_lines_.emplace_back(mode.pattern);
    settled_.assign(blocks.size(), 0);
    for (std::size_t b = 1; b < blocks.size(); ++b) settled_[b] = settles(timing_, blocks[b - 1]);
  }

  /// Begins with a problem; the continuous inputs of its sequences are the plan's.
  void start(const Problem<M>& problem, const Plan<M>& plan) noexcept {
    auto step = planned_.begin();
    for (std::size_t b = 0; b < plan.continuous.size(); ++b)
      step = std::fill_n(step, problem.horizon.blocks[b], plan.continuous[b]);
  }

  /// Rolls `count` sequences, 1 to max_lanes. choose(lane, block, lines) is asked, block after block, for the mode that a
  /// lane commands on top of the commands in flight as the block begins.
  /// Returns the model steps asked for, those of the last register's unused lanes included.
  template <class Choose>
  std::int64_t roll(const Problem<M>& problem, int count, Choose&& choose) noexcept {
    begin_lanes(problem, count);
    int first = 0;
    for (std::size_t b = 0; b < settled_.size(); ++b) {
      const int length = problem.horizon.blocks[b];
      builder_.begin(flight(problem, b, count), inputs_);
      for (int lane = 0; lane < count; ++lane)
        command(problem, b, lane, choose(lane, b, lines_before(problem, b, lane)));
      pad_lanes(kernel_.width, inputs_, lanes_);
      kernel_.roll(problem, {planned_.data(), first, length, Bounds<M>::infinity}, inputs_, lanes_);
      first += length;
    }
    return steps(count, problem.horizon);
  }
  /// The model steps that rolling `count` sequences asks for.
  std::int64_t steps(int count, const Horizon& horizon) const noexcept {
    return std::int64_t{kernel_.whole_registers(count)} * horizon.steps();
  }

  /// What the lane's sequence costs; no number where the prediction is none.
  double cost(const Problem<M>& problem, int lane) const noexcept {
    const auto i = static_cast<std::size_t>(lane);
    StateOf<M> end;
    for (std::size_t k = 0; k < M::state_size; ++k) end[k] = lanes_.state[k][i];
    return rollout_detail::weighted_square<M, double>(problem.cost.terminal, problem.reference.back(),
                                                      problem.model.template output<double>(end), lanes_.cost[i]);
  }
  /// How many switches it changes, the first against the command in force.
  int switches(int lane) const noexcept { return switches_[static_cast<std::size_t>(lane)]; }
  /// The timing of the switches in steps.
  const SwitchTiming& timing() const noexcept { return timing_; }

 private:
  void begin_lanes(const Problem<M>& problem, int count) noexcept {
    lanes_.count = count;
    for (int lane = 0; lane < count; ++lane) {
      for (std::size_t k = 0; k < M::state_size; ++k) lanes_.state[k][lane] = problem.initial[k];
      lanes_.cost[lane] = 0.0;
    }
    std::fill_n(switches_.begin(), count, 0);
  }

  /// Steps until the last edge that is still on its way in any lane as block b begins, 0 for none.
  int flight(const Problem<M>& problem, std::size_t b, int count) const noexcept {
    if (b == 0) return problem.lines.settled_after();
    int last = 0;
    for (int lane = 0; lane < count && !settled_[b]; ++lane)
      last = std::max(last, lines_[static_cast<std::size_t>(lane)].settled_after());
    return last;
  }

  /// The commands in flight as block b begins, until the lane commands its mode.
  const DelayLines& lines_before(const Problem<M>& problem, std::size_t b, int lane) const noexcept {
    const auto i = static_cast<std::size_t>(lane);
    if (b == 0) return problem.lines;
    return settled_[b] ? settled_lines_[static_cast<std::size_t>(mode_[i])] : lines_[i];
  }

  void command(const Problem<M>& problem, std::size_t b, int lane, int mode) noexcept {
    const auto i = static_cast<std::size_t>(lane);
    const DelayLines& lines = lines_before(problem, b, lane);
    const SwitchPattern pattern = problem.modes.pattern(mode);
    const int changes = std::popcount(pattern ^ lines.commanded());
    const double before = lines.may_command(pattern, timing_) ? lanes_.cost[i] : Bounds<M>::infinity;
    lanes_.cost[i] = before + problem.cost.switching * changes;
    switches_[i] += changes;
    builder_.command(lines, pattern, lane, inputs_);
    if (b + 1 < settled_.size() && !settled_[b + 1]) {
      DelayLines next = lines;
      next.command(pattern, timing_);
      next.advance(problem.horizon.blocks[b]);
      lines_[i] = next;
    }
    mode_[i] = mode;
  }

  RolloutKernel<M> kernel_;
  SwitchTiming timing_;
  LaneInputBuilder<M> builder_;
  LaneInputs<M> inputs_;
  Lanes<M> lanes_;
  std::vector<ContinuousOf<M>> planned_;   // one a step
  std::vector<DelayLines> settled_lines_;  // of a mode
  std::vector<char> settled_;  // whether earlier commands are over as a block begins, and nothing holds a switch
  std::array<DelayLines, max_lanes> lines_;
  std::array<int, max_lanes> mode_{}, switches_{};
};

}  // namespace solenoid
