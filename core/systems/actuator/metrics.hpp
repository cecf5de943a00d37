#pragma once

#include "core/metrics/metrics.hpp"
#include "core/reference/motion.hpp"

#include <span>

namespace solenoid {

/// Evaluates a run of the actuator, in the figures of the thesis's 6.3 and beyond; a solve that took longer than
/// `deadline_us` is a miss. Errors are y_d - y [mm]; the definitions are those of model.md, section 8.
///
/// rmse_mm, mae_mm                     true position, whole run
/// rmse_measured_mm, mae_measured_mm   measured and filtered position (model.md, E13)
/// sse_mean_abs_mm                     steady part: mean |error|
/// sse_abs_mean_mm                     steady part: |mean error| (model.md, E11)
/// sse_max_abs_mm                      steady part: max |error|, the reading of tables 5-2 to 5-4
/// ssa_mm                              steady part: max y - min y
/// itae                                integral of t |error| [mm s2]
/// overshoot_percent                   beyond the steady position, relative to the way to it
/// coil_switches, switches_per_s       coil changes
/// busiest_coil_per_s                  changes of the coil that changes most
/// life_years, valves_usd              0 here: whoever knows the valves adds them
/// steady_switches_per_s               steady part: what holding still costs
/// air_g, air_nl                       supply air; normal litres at 0 C and 101 325 Pa (DIN 1343)
/// steady_air_g_per_s                  steady part; 0 where the supply air at its beginning is not known
/// motor_rms_n                         motor force
Metrics evaluate_actuator_run(std::span<const TickRecord> ticks, const Motion& motion, double tick_s,
                              const Consumed& air_kg, double deadline_us);

}  // namespace solenoid
