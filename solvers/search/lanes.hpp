#pragma once

#include "core/mpc/rollout.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <xsimd/xsimd.hpp>

namespace solenoid {

/// Candidates that a kernel rolls together: enough that registers of eight are filled by few parents' children.
inline constexpr int max_lanes = 64;

/// Candidates under way, one a lane.
template <HybridModel M>
struct alignas(64) Lanes {
  double state[M::state_size][max_lanes];
  double cost[max_lanes];
  int count = 0;
};

/// Boxes of reachable states under way, one a lane, with a lower bound of the cost of every way inside.
template <HybridModel M>
struct alignas(64) Boxes {
  double low[M::state_size][max_lanes];
  double high[M::state_size][max_lanes];
  double cost[max_lanes];
  int count = 0;
};

/// Switched inputs of each lane, constant over pieces of time: piece p holds from step begin[p], counted from the first
/// step of the roll, to the next piece or the end.
template <HybridModel M>
struct LaneInputs {
  /// The switched inputs of every lane in one piece.
  struct alignas(64) Piece {
    double value[M::switched_size][max_lanes];
  };
  std::vector<int> begin;
  std::vector<Piece> piece;
  int pieces = 0;
  bool in_flight = false;

  void reserve(std::size_t n) {
    begin.resize(n);
    piece.resize(n);
  }
};

/// What to roll: `length` steps from step `first` of the horizon. The roll may stop early once every lane's cost is
/// above `cutoff`; its costs are then lower bounds above cutoff and its states are of no use.
/// shapes   planned: the plan's continuous inputs, one a step of the horizon
template <HybridModel M>
struct RollSpan {
  const ContinuousOf<M>* planned = nullptr;
  int first = 0;
  int length = 0;
  double cutoff = 0.0;
  bool hurry = false;  ///< a bound may be given up early where it promises little
};

namespace kernel_detail {

inline constexpr int check_every = 5;  // steps between looks at the cutoff

template <class Batch, std::size_t rows>
using Rows = Vector<Batch, rows>;

template <class Batch, std::size_t rows>
Rows<Batch, rows> load_rows(const double (&source)[rows][max_lanes], int lane) {
  Rows<Batch, rows> r;
  for (std::size_t i = 0; i < rows; ++i) r[i] = Batch::load_aligned(&source[i][lane]);
  return r;
}

template <class Batch, std::size_t rows>
void store_rows(const Rows<Batch, rows>& r, double (&target)[rows][max_lanes], int lane) {
  for (std::size_t i = 0; i < rows; ++i) r[i].store_aligned(&target[i][lane]);
}

/// Walks steps [from, to) of a span piece by piece: load(p) as piece p begins, advance(j) for each step j of the horizon,
/// and every few steps open(): whether any lane is still worth it.
template <HybridModel M, class Load, class Advance, class Open>
inline void march(const RollSpan<M>& span, int from, int to, const std::vector<int>& begin, int pieces, Load load,
                  Advance advance, Open open) {
  int step = from, next_check = from + check_every;
  for (int p = 0; p < pieces && step < to; ++p) {
    const int end = p + 1 < pieces ? std::min(begin[static_cast<std::size_t>(p) + 1], to) : to;
    if (end <= step) continue;
    load(static_cast<std::size_t>(p));
    for (; step < end; ++step) {
      advance(static_cast<std::size_t>(span.first + step));
      if (step != next_check) continue;
      next_check += check_every;
      if (!open()) return;
    }
  }
}

/// Calls each(batches as a constant, first lane, type of register) for registers that cover `count` lanes, in pairs: two
/// interleaved fill the divider, and more would stop early less often.
template <class Batch, class Narrow, class Each>
void in_registers(int count, Each each) {
  constexpr int width = static_cast<int>(Batch::size);
  if (count <= static_cast<int>(Narrow::size))  // half a register divides and takes roots in half the time
    return each(std::integral_constant<int, 1>{}, 0, static_cast<Narrow*>(nullptr));
  int lane = 0;
  for (; count - lane > width; lane += 2 * width)
    each(std::integral_constant<int, 2>{}, lane, static_cast<Batch*>(nullptr));
  if (lane < count) each(std::integral_constant<int, 1>{}, lane, static_cast<Batch*>(nullptr));
}

}  // namespace kernel_detail
}  // namespace solenoid
