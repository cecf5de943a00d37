// The body of one kernels_*.cpp: everything in the namespace of its instruction set, nothing inline shared with others.
#include "solvers/qp/simd/kernel_table.hpp"
#include "solvers/qp/simd/sizes.hpp"

namespace solenoid::qp::SOLENOID_QP_ISA {
#include "solvers/qp/simd/lanes.hpp"
#include "solvers/qp/simd/row_kernels.hpp"
//
#include "solvers/qp/simd/stage_lanes.hpp"
//
#include "solvers/qp/simd/riccati_lanes.hpp"

const RowKernels& rows();
const RowKernels& rows() { return row_table; }

#define SOLENOID_QP_DEFINE(nx, nu)             \
  const RiccatiKernels& riccati_##nx##_##nu(); \
  const RiccatiKernels& riccati_##nx##_##nu() { return riccati_table<nx, nu>; }
SOLENOID_QP_SIZES(SOLENOID_QP_DEFINE)
#undef SOLENOID_QP_DEFINE

}  // namespace solenoid::qp::SOLENOID_QP_ISA
