#pragma once

/// State and input dimensions with kernels for every instruction set; any other size works, compiled by its user.
#define SOLENOID_QP_SIZES(apply) \
  apply(1, 1) apply(2, 1) apply(2, 2) apply(3, 2) apply(4, 1) apply(4, 2) apply(4, 3) apply(4, 4) apply(6, 3)
