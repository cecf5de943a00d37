#pragma once

#include "solvers/search/lanes.hpp"

namespace solenoid::kernel_detail {

/// Squared distance of the reference from the box of outputs, the box first widened by its rounding.
template <HybridModel M, class Batch>
Batch outside_square(const OutputOf<M>& weight, const OutputOf<M>& reference, const Rows<Batch, M::output_size>& low,
                     const Rows<Batch, M::output_size>& high, Batch sum) {
  for (std::size_t i = 0; i < M::output_size; ++i) {
    const Batch r(reference[i]);
    const Batch distance =
        xsimd::max(low[i] - r, r - high[i]) - Batch(1e-11) * (xsimd::abs(low[i]) + xsimd::abs(high[i]));
    const Batch outside = xsimd::max(distance, Batch(0.0));
    sum = sum + Batch(weight[i] * (1 - 1e-9)) * (outside * outside);
  }
  return sum;
}

/// Steps [from, to) of a span for `batches` registers of boxes from lane `lane0`.
template <HybridModel M, class Batch, int batches>
[[SOLENOID_FLATTEN]] void enclose_some(const Problem<M>& problem, const RollSpan<M>& span, int from, int to,
                                       const LaneInputs<M>& lowest, const LaneInputs<M>& highest, Boxes<M>& boxes,
                                       int lane0) noexcept {
  constexpr int width = static_cast<int>(Batch::size);
  Rows<Batch, M::state_size> low[batches], high[batches];
  Rows<Batch, M::switched_size> least[batches], most[batches];
  Batch cost[batches];
  for (int w = 0; w < batches; ++w) {
    low[w] = load_rows<Batch>(boxes.low, lane0 + w * width);
    high[w] = load_rows<Batch>(boxes.high, lane0 + w * width);
    cost[w] = Batch::load_aligned(&boxes.cost[lane0 + w * width]);
  }
  const auto load = [&](std::size_t p) {
    for (int w = 0; w < batches; ++w) {
      least[w] = load_rows<Batch>(lowest.piece[p].value, lane0 + w * width);
      most[w] = load_rows<Batch>(highest.piece[p].value, lane0 + w * width);
    }
  };
  const auto advance = [&](std::size_t j) {
    OutputOf<M> setpoint{};
    if constexpr (HasFeedback<M>) setpoint = problem.setpoint[j];
    for (int w = 0; w < batches; ++w) {
      problem.model.template enclose_step<Batch>(low[w], high[w], least[w], most[w], setpoint, span.planned[j],
                                                 problem.horizon.dt_s);
      cost[w] = outside_square<M, Batch>(problem.cost.tracking, problem.reference[j],
                                         problem.model.template output<Batch>(low[w]),
                                         problem.model.template output<Batch>(high[w]), cost[w]);
    }
  };
  march<M>(span, from, to, lowest.begin, lowest.pieces, load, advance, [] { return true; });
  if (static_cast<std::size_t>(span.first + to) == problem.reference.size())
    for (int w = 0; w < batches; ++w)
      cost[w] = outside_square<M, Batch>(problem.cost.terminal, problem.reference.back(),
                                         problem.model.template output<Batch>(low[w]),
                                         problem.model.template output<Batch>(high[w]), cost[w]);
  for (int w = 0; w < batches; ++w) {
    store_rows<Batch>(low[w], boxes.low, lane0 + w * width);
    store_rows<Batch>(high[w], boxes.high, lane0 + w * width);
    cost[w].store_aligned(&boxes.cost[lane0 + w * width]);
  }
}

/// Which boxes to follow further, by lane, and whose they are. Any stop is a valid bound; a lane is left when
///
/// - its cost is above the cutoff: nothing below its node is worth it;
/// - its box held the reference since the last look: it is too wide by now to say more. Where the last state has a cost of
///   its own, that is no reason to stop;
/// - in a hurry and after `worth_all_steps` looks, four times its last gain at every look to come does not reach the cutoff;
/// - after as many looks its cost is within one switch change of the cutoff: all children but the one that
///   changes nothing are excluded, and to roll that one is cheaper.
template <HybridModel M>
class OpenBoxes {
 public:
  OpenBoxes(const Problem<M>& problem, const RollSpan<M>& span, Boxes<M>& boxes)
      : boxes_(boxes),
        cutoff_(span.cutoff),
        switch_change_(problem.cost.switching),
        count_(boxes.count),
        most_looks_((span.length + check_every - 1) / check_every),
        hurry_(span.hurry) {
    to_the_end_ = cutoff_ == Bounds<M>::infinity;  // nothing is to be left out
    for (const double weight : problem.cost.terminal) to_the_end_ = to_the_end_ || weight > 0.0;
    for (int lane = 0; lane < count_; ++lane) before_[lane] = boxes.cost[lane], owner_[lane] = lane;
  }

  int count() const { return count_; }

  /// Moves the open lanes to the front, with their inputs of the pieces from `piece` on, if that empties a register.
  void close(std::size_t piece, int width, LaneInputs<M>& lowest, LaneInputs<M>& highest) noexcept {
    const double enough = ++looks_ < worth_all_steps ? cutoff_ : cutoff_ - switch_change_;
    int open[max_lanes], opened = 0;
    for (int lane = 0; lane < count_; ++lane) {
      const double cost = boxes_.cost[lane];
      if (cost <= enough && (to_the_end_ || promises(cost, cost - before_[lane]))) open[opened++] = lane;
      before_[lane] = cost;
    }
    if (opened > 0 && (count_ - 1) / width == (opened - 1) / width) return;
    keep_costs();
    for (int to = 0; to < opened; ++to)
      if (open[to] != to) move(open[to], to, piece, lowest, highest);
    count_ = opened;
  }

  /// Gives every box its cost.
  void finish() noexcept {
    keep_costs();
    std::copy_n(cost_, boxes_.count, boxes_.cost);
  }

 private:
  static constexpr int worth_all_steps = 4;

  bool promises(double cost, double gain) const noexcept {
    return gain > 0.0 && (!hurry_ || looks_ < worth_all_steps || cost + 4.0 * gain * (most_looks_ - looks_) > cutoff_);
  }

  void keep_costs() noexcept {
    for (int lane = 0; lane < count_; ++lane) cost_[owner_[lane]] = boxes_.cost[lane];
  }

  void move(int from, int to, std::size_t piece, LaneInputs<M>& lowest, LaneInputs<M>& highest) noexcept {
    owner_[to] = owner_[from];
    before_[to] = before_[from];
    boxes_.cost[to] = boxes_.cost[from];
    for (auto* rows : {&boxes_.low, &boxes_.high})
      for (auto& row : *rows) row[to] = row[from];
    for (auto* inputs : {&lowest, &highest})
      for (std::size_t p = piece; p < static_cast<std::size_t>(inputs->pieces); ++p)
        for (auto& row : inputs->piece[p].value) row[to] = row[from];
  }

  Boxes<M>& boxes_;
  double cutoff_, switch_change_;
  int count_, most_looks_, looks_ = 0;
  bool hurry_;
  bool to_the_end_ = false;
  int owner_[max_lanes];
  double before_[max_lanes];  // cost at the last look
  double cost_[max_lanes];    // of each box, so far as it was followed
};

/// Follows boxes a few steps at a time, those that are still open in as few registers as they fit in.
template <HybridModel M, class Batch, class Narrow>
void enclose(const Problem<M>& problem, const RollSpan<M>& span, LaneInputs<M>& lowest, LaneInputs<M>& highest,
             Boxes<M>& boxes) noexcept {
  OpenBoxes<M> open(problem, span, boxes);
  std::size_t piece = 0;
  for (int from = 0; from < span.length && open.count() > 0; from += check_every) {
    const int to = std::min(from + check_every, span.length);
    const auto some = [&]<class Register>(auto batches, int lane, Register*) {
      enclose_some<M, Register, batches>(problem, span, from, to, lowest, highest, boxes, lane);
    };
    in_registers<Batch, Narrow>(open.count(), some);
    while (piece + 1 < static_cast<std::size_t>(lowest.pieces) && lowest.begin[piece + 1] <= to) ++piece;
    open.close(piece, static_cast<int>(Batch::size), lowest, highest);
  }
  open.finish();
}

}  // namespace solenoid::kernel_detail
