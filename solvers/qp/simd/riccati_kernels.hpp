#pragma once

#include "solvers/qp/simd/kernel_table.hpp"
#include "solvers/qp/simd/sizes.hpp"

namespace solenoid::qp {

namespace portable {
#include "solvers/qp/simd/lanes.hpp"
//
#include "solvers/qp/simd/stage_lanes.hpp"
//
#include "solvers/qp/simd/riccati_lanes.hpp"
}  // namespace portable

/// Kernels for one pair of sizes: those of sizes.hpp by instruction set, any other as this translation unit is
/// compiled.
template <int NX, int NU>
const RiccatiKernels& riccati_kernels(Isa) {
  return portable::riccati_table<NX, NU>;
}

#define SOLENOID_QP_DECLARE(nx, nu) \
  template <>                       \
  const RiccatiKernels& riccati_kernels<nx, nu>(Isa isa);
SOLENOID_QP_SIZES(SOLENOID_QP_DECLARE)
#undef SOLENOID_QP_DECLARE

}  // namespace solenoid::qp
