#define SOLENOID_QP_ISA avx2
#include "solvers/qp/simd/instantiate.hpp"
