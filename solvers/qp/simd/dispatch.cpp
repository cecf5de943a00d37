#include "solvers/qp/simd/riccati_kernels.hpp"

namespace solenoid::qp {

#define SOLENOID_QP_DECLARE(nx, nu) const RiccatiKernels& riccati_##nx##_##nu();
namespace baseline {
const RowKernels& rows();
SOLENOID_QP_SIZES(SOLENOID_QP_DECLARE)
}  // namespace baseline
#if defined(__x86_64__)
namespace avx2 {
const RowKernels& rows();
SOLENOID_QP_SIZES(SOLENOID_QP_DECLARE)
}  // namespace avx2
namespace avx512 {
const RowKernels& rows();
SOLENOID_QP_SIZES(SOLENOID_QP_DECLARE)
}  // namespace avx512
#endif
#undef SOLENOID_QP_DECLARE

Isa resolve(Isa isa) {
#if defined(__x86_64__)
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool has_avx512 =
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  if (isa == Isa::best) isa = has_avx512 ? Isa::avx512 : Isa::avx2;
  if (isa == Isa::avx512 && has_avx512) return Isa::avx512;
  if (isa == Isa::avx2 && has_avx2) return Isa::avx2;
#endif
  return Isa::baseline;
}

#if defined(__x86_64__)
#define SOLENOID_QP_CHOOSE(what) \
  switch (resolve(isa)) {        \
    case Isa::avx512:            \
      return avx512::what();     \
    case Isa::avx2:              \
      return avx2::what();       \
    default:                     \
      return baseline::what();   \
  }
#else
#define SOLENOID_QP_CHOOSE(what) return resolve(isa), baseline::what();
#endif

const RowKernels& row_kernels(Isa isa){SOLENOID_QP_CHOOSE(rows)}

#define SOLENOID_QP_DEFINE(nx, nu)                         \
  template <>                                              \
  const RiccatiKernels& riccati_kernels<nx, nu>(Isa isa) { \
    SOLENOID_QP_CHOOSE(riccati_##nx##_##nu)                \
  }
SOLENOID_QP_SIZES(SOLENOID_QP_DEFINE)

}  // namespace solenoid::qp
