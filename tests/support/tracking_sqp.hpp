#pragma once

#include "solvers/sqp/sqp.hpp"
#include "tests/support/tracking_nlp.hpp"

namespace solenoid {

/// Compiled once, in tracking_sqp.cpp, for the tests and benchmarks that solve the recorded programs.
extern template class Sqp<test::TrackingSlide, 2, 0>;

}  // namespace solenoid
