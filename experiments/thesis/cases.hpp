#pragma once

#include "experiments/thesis/reproduce.hpp"

#include <vector>

namespace solenoid {

/// Step tests (5.2.3, 5.3, 5.4) under `inferred`, with sensor noise, several seeds each.
std::vector<ReproducedCase> table_5_2();
std::vector<ReproducedCase> table_5_3();
std::vector<ReproducedCase> table_5_4();

/// Simulations of chapter 6 under four parameter sets; the controllers see the true state, never the payload.
std::vector<ReproducedCase> table_6_1();
std::vector<ReproducedCase> table_6_2();

}  // namespace solenoid
