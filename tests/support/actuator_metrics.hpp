#pragma once

#include "core/systems/actuator/metrics.hpp"

namespace solenoid {

/// Metrics of a run of the actuator in which nothing happened: every number is there, and zero.
inline Metrics no_metrics() { return evaluate_actuator_run({}, Trajectory(0.0), 0.001, {}, 0.0); }

}  // namespace solenoid
