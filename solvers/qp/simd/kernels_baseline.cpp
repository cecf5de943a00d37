#define SOLENOID_QP_ISA baseline
#include "solvers/qp/simd/instantiate.hpp"
