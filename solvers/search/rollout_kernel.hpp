#pragma once

#include "core/mpc/rollout.hpp"
#include "solvers/search/compiled_kernels.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <xsimd/xsimd.hpp>

namespace solenoid {

/// Candidates that a kernel rolls together.
inline constexpr int max_lanes = 32;

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
};

/// The inner loops of the searches, compiled for one instruction set. Lanes go through the same formulas in the same
/// order as the scalar rollout (core/mpc/rollout.hpp), without contraction: every lane equals it to the last bit.
template <HybridModel M>
struct RolloutKernel {
  const char* architecture;
  int width;  ///< doubles a register
  void (*roll)(const Problem<M>&, const RollSpan<M>&, const LaneInputs<M>&, Lanes<M>&) noexcept;
  /// Null for models without an enclosure. Adds to each lane's cost a lower bound of the tracking cost of the span.
  void (*enclose)(const Problem<M>&, const RollSpan<M>&, const LaneInputs<M>& lowest, const LaneInputs<M>& highest,
                  Boxes<M>&) noexcept;
};

/// The fastest kernel for this machine: for models with compiled_kernels the library's best, chosen at run time; for
/// others one of the translation unit's own instruction set.
template <HybridModel M>
const RolloutKernel<M>& rollout_kernel();

/// The library's best, which has its definition.
template <HybridModel M>
requires compiled_kernels<M>
const RolloutKernel<M>& compiled_kernel();

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

template <HybridModel M, class Batch>
Batch outside_bounds(const Bounds<M>& bounds, const Rows<Batch, M::state_size>& x) {
  auto bad = x[0] < Batch(bounds.state_lower[0]);
  for (std::size_t i = 0; i < M::state_size; ++i)
    bad = bad | (x[i] < Batch(bounds.state_lower[i])) | (x[i] > Batch(bounds.state_upper[i]));
  return xsimd::select(bad, Batch(Bounds<M>::infinity), Batch(0.0));
}

/// Walks a span piece by piece: load(p) as piece p begins, advance(j) for each step j of the horizon, and every few
/// steps open(): whether any lane is still worth it.
template <HybridModel M, class Load, class Advance, class Open>
inline void march(const RollSpan<M>& span, const std::vector<int>& begin, int pieces, Load load, Advance advance,
                  Open open) {
  int step = 0, next_check = check_every;
  for (int p = 0; p < pieces && step < span.length; ++p) {
    const int end = p + 1 < pieces ? std::min(begin[static_cast<std::size_t>(p) + 1], span.length) : span.length;
    load(static_cast<std::size_t>(p));
    for (; step < end; ++step) {
      advance(static_cast<std::size_t>(span.first + step));
      if (step != next_check) continue;
      next_check += check_every;
      if (!open()) return;
    }
  }
}

template <class Batch, int batches>
bool any_below(const Batch (&cost)[batches], const Batch& cutoff) {
  auto open = cost[0] <= cutoff;
  for (int w = 1; w < batches; ++w) open = open | (cost[w] <= cutoff);
  return xsimd::any(open);
}

/// `batches` registers of candidates from lane `lane0`, interleaved so that one's latency hides behind the others.
template <HybridModel M, class Batch, int batches, bool constrained>
[[SOLENOID_FLATTEN]] void roll_some(const Problem<M>& problem, const RollSpan<M>& span, const LaneInputs<M>& inputs,
                                    Lanes<M>& lanes, int lane0) noexcept {
  constexpr int width = static_cast<int>(Batch::size);
  Rows<Batch, M::state_size> x[batches];
  Rows<Batch, M::switched_size> s[batches];
  Batch cost[batches];
#pragma GCC unroll 2
  for (int w = 0; w < batches; ++w) {
    x[w] = load_rows<Batch>(lanes.state, lane0 + w * width);
    cost[w] = Batch::load_aligned(&lanes.cost[lane0 + w * width]);
  }
  const Batch cutoff(span.cutoff);
  const auto load = [&](std::size_t p) {
#pragma GCC unroll 2
    for (int w = 0; w < batches; ++w) s[w] = load_rows<Batch>(inputs.piece[p].value, lane0 + w * width);
  };
  const auto advance = [&](std::size_t j) {
#pragma GCC unroll 2
    for (int w = 0; w < batches; ++w) {
      roll_step<M, Batch>(problem, j, s[w], span.planned[j], x[w], cost[w]);
      if constexpr (constrained) cost[w] = cost[w] + outside_bounds<M, Batch>(problem.bounds, x[w]);
    }
  };
  march<M>(span, inputs.begin, inputs.pieces, load, advance, [&] { return any_below(cost, cutoff); });
#pragma GCC unroll 2
  for (int w = 0; w < batches; ++w) {
    store_rows<Batch>(x[w], lanes.state, lane0 + w * width);
    cost[w].store_aligned(&lanes.cost[lane0 + w * width]);
  }
}

/// Calls each(batches as a constant, first lane) for registers that cover `count` lanes, in pairs: two interleaved fill
/// the divider, and more would stop early less often.
template <class Batch, class Each>
void for_registers(int count, Each each) {
  constexpr int width = static_cast<int>(Batch::size);
  int lane = 0;
  for (; count - lane > width; lane += 2 * width) each(std::integral_constant<int, 2>{}, lane);
  if (lane < count) each(std::integral_constant<int, 1>{}, lane);
}

template <HybridModel M, class Batch, class Narrow>
void roll(const Problem<M>& problem, const RollSpan<M>& span, const LaneInputs<M>& inputs, Lanes<M>& lanes) noexcept {
  const bool constrained = problem.bounds.constrain_state();
  const auto some = [&]<class Register>(auto batches, int lane, Register*) {
    if (constrained)
      roll_some<M, Register, batches, true>(problem, span, inputs, lanes, lane);
    else
      roll_some<M, Register, batches, false>(problem, span, inputs, lanes, lane);
  };
  if (lanes.count <= static_cast<int>(Narrow::size))  // half a register divides and takes roots in half the time
    some(std::integral_constant<int, 1>{}, 0, static_cast<Narrow*>(nullptr));
  else
    for_registers<Batch>(lanes.count,
                         [&](auto batches, int lane) { some(batches, lane, static_cast<Batch*>(nullptr)); });
}

/// Squared distance of the reference from the box of outputs, the box first widened by its rounding.
template <HybridModel M, class Batch>
Batch outside_square(const OutputOf<M>& weight, const OutputOf<M>& reference, const Rows<Batch, M::output_size>& low,
                     const Rows<Batch, M::output_size>& high, Batch sum) {
  for (std::size_t i = 0; i < M::output_size; ++i) {
    const Batch r(reference[i]);
    const Batch distance =
        xsimd::max(low[i] - r, r - high[i]) - Batch(1e-12) * (xsimd::abs(low[i]) + xsimd::abs(high[i]));
    const Batch outside = xsimd::max(distance, Batch(0.0));
    sum = sum + Batch(weight[i] * (1 - 1e-9)) * (outside * outside);
  }
  return sum;
}

template <HybridModel M, class Batch, int batches>
[[SOLENOID_FLATTEN]] void enclose_some(const Problem<M>& problem, const RollSpan<M>& span, const LaneInputs<M>& lowest,
                                       const LaneInputs<M>& highest, Boxes<M>& boxes, int lane0) noexcept {
  constexpr int width = static_cast<int>(Batch::size);
  Rows<Batch, M::state_size> low[batches], high[batches];
  Rows<Batch, M::switched_size> least[batches], most[batches];
  Batch cost[batches];
  for (int w = 0; w < batches; ++w) {
    low[w] = load_rows<Batch>(boxes.low, lane0 + w * width);
    high[w] = load_rows<Batch>(boxes.high, lane0 + w * width);
    cost[w] = Batch::load_aligned(&boxes.cost[lane0 + w * width]);
  }
  const Batch cutoff(span.cutoff);
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
  march<M>(span, lowest.begin, lowest.pieces, load, advance, [&] { return any_below(cost, cutoff); });
  for (int w = 0; w < batches; ++w) cost[w].store_aligned(&boxes.cost[lane0 + w * width]);
}

template <HybridModel M, class Batch>
void enclose(const Problem<M>& problem, const RollSpan<M>& span, const LaneInputs<M>& lowest,
             const LaneInputs<M>& highest, Boxes<M>& boxes) noexcept {
  for_registers<Batch>(boxes.count, [&](auto batches, int lane) {
    enclose_some<M, Batch, batches>(problem, span, lowest, highest, boxes, lane);
  });
}

}  // namespace kernel_detail

/// The kernel of one instruction set; instantiate it only in a translation unit compiled for that set. Few candidates
/// go into a register of `NarrowArch`.
template <HybridModel M, class Arch, class NarrowArch = Arch>
RolloutKernel<M> make_rollout_kernel(const char* architecture) {
  using Batch = xsimd::batch<double, Arch>;
  RolloutKernel<M> kernel{architecture, static_cast<int>(Batch::size),
                          &kernel_detail::roll<M, Batch, xsimd::batch<double, NarrowArch>>, nullptr};
  if constexpr (HasEnclosure<M>) kernel.enclose = &kernel_detail::enclose<M, Batch>;
  return kernel;
}

template <HybridModel M>
const RolloutKernel<M>& rollout_kernel() {
  if constexpr (compiled_kernels<M>) {
    return compiled_kernel<M>();
  } else {
    static const RolloutKernel<M> kernel = make_rollout_kernel<M, xsimd::default_arch>(xsimd::default_arch::name());
    return kernel;
  }
}

}  // namespace solenoid
