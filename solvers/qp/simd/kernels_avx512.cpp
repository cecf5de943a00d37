#define SOLENOID_QP_ISA avx512
#include "solvers/qp/simd/instantiate.hpp"
