#pragma once

#include "core/metrics/metrics.hpp"
#include "core/system/description.hpp"

#include <span>

namespace solenoid {

/// The planar free-flyer as everything above the solvers knows it. A tick is 10 ms, a period 100 ms: the shortest pulse
/// of the thrusters.
const SystemDescription& thrusters_description();

/// Evaluates a run of it; a solve that took longer than `deadline_us` is a miss.
///
/// rmse_mm, largest_mm      distance of the true position from the desired one, its root mean square and maximum
/// rmse_deg, largest_deg    the same of the angle
/// air_g                    through the thrusters
/// switches, switches_per_s changes of a thruster
/// final_mm, final_deg      mean distance and angle over the last second
Metrics evaluate_thrusters_run(std::span<const TickRecord> ticks, double tick_s, const Consumed& air_kg,
                               double deadline_us);

}  // namespace solenoid
