#pragma once

#include "solvers/search/compiled_kernels.hpp"
#include "solvers/search/enclosures.hpp"

namespace solenoid {

/// The inner loops of the searches, compiled for one instruction set. Lanes go through the same formulas in the same
/// order as the scalar rollout (core/mpc/rollout.hpp), without contraction: every lane equals it to the last bit.
template <HybridModel M>
struct RolloutKernel {
  const char* architecture;
  int width;  ///< doubles a register
  /// Lanes that so many take, those of the last register included.
  int whole_registers(int lanes) const noexcept { return (lanes + width - 1) / width * width; }
  void (*roll)(const Problem<M>&, const RollSpan<M>&, const LaneInputs<M>&, Lanes<M>&) noexcept;
  /// Null for models without an enclosure. Adds to each lane's cost a lower bound of the tracking cost of the span, and
  /// of the terminal cost where the span ends with the horizon. Leaves boxes and inputs of no use.
  void (*enclose)(const Problem<M>&, const RollSpan<M>&, LaneInputs<M>& lowest, LaneInputs<M>& highest,
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

template <HybridModel M, class Batch>
Batch outside_bounds(const Bounds<M>& bounds, const Rows<Batch, M::state_size>& x) {
  auto bad = x[0] < Batch(-Bounds<M>::infinity);  // never
  for (std::size_t i = 0; i < M::state_size; ++i)
    if (bounds.state_penalty[i] == 0.0)
      bad = bad | (x[i] < Batch(bounds.state_lower[i])) | (x[i] > Batch(bounds.state_upper[i]));
  return xsimd::select(bad, Batch(Bounds<M>::infinity), Batch(0.0));
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
  march<M>(span, 0, span.length, inputs.begin, inputs.pieces, load, advance, [&] { return any_below(cost, cutoff); });
#pragma GCC unroll 2
  for (int w = 0; w < batches; ++w) {
    store_rows<Batch>(x[w], lanes.state, lane0 + w * width);
    cost[w].store_aligned(&lanes.cost[lane0 + w * width]);
  }
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
  in_registers<Batch, Narrow>(lanes.count, some);
}

}  // namespace kernel_detail

/// The kernel of one instruction set; instantiate it only in a translation unit compiled for that set. Few candidates
/// go into a register of `NarrowArch`.
template <HybridModel M, class Arch, class NarrowArch = Arch>
RolloutKernel<M> make_rollout_kernel(const char* architecture) {
  using Batch = xsimd::batch<double, Arch>;
  RolloutKernel<M> kernel{architecture, static_cast<int>(Batch::size),
                          &kernel_detail::roll<M, Batch, xsimd::batch<double, NarrowArch>>, nullptr};
  if constexpr (HasEnclosure<M>) kernel.enclose = &kernel_detail::enclose<M, Batch, xsimd::batch<double, NarrowArch>>;
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
