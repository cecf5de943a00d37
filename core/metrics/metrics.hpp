#pragma once

#include "core/rt/recorder.hpp"

#include <span>
#include <vector>

namespace solenoid {

/// These are order statistics of a sample, in its unit; all are 0 for an empty one.
struct Percentiles {
  double p50 = 0, p90 = 0, p99 = 0, p999 = 0, max = 0;
};
/// Returns nearest-rank percentiles and sorts its argument.
Percentiles percentiles(std::vector<double>& sample);

/// Metrics say how a run went, in the figures of the thesis's 6.3 and beyond. Errors are y_d - y [mm]; the definitions
/// are those of model.md, section 8.
struct Metrics {
  double rmse_mm = 0, mae_mm = 0;                    ///< true position, whole run
  double rmse_measured_mm = 0, mae_measured_mm = 0;  ///< measured and filtered position (model.md, E13)
  double sse_mean_abs_mm = 0;                        ///< steady part: mean |error|
  double sse_abs_mean_mm = 0;                        ///< steady part: |mean error| (model.md, E11)
  double sse_max_abs_mm = 0;                         ///< steady part: max |error|, the reading of tables 5-2 to 5-4
  double ssa_mm = 0;                                 ///< steady part: max y - min y
  double itae = 0;                                   ///< integral of t |error| [mm s2]
  double overshoot_percent = 0;                      ///< beyond the steady position, relative to the way to it
  int coil_switches = 0;
  double switches_per_s = 0;
  double steady_switches_per_s = 0;  ///< steady part: coil changes, what holding still costs
  double air_g = 0, air_nl = 0;      ///< supply air; normal litres at 0 C and 101 325 Pa (DIN 1343)
  double steady_air_g_per_s = 0;     ///< steady part; 0 where the supply air at its beginning is not known
  double motor_rms_n = 0;
  Percentiles solve_us;
  int deadline_misses = 0;
  double proven_optimal_fraction = 0;  ///< of the solves
  bool finite = true;                  ///< false if any state was not: the run is unstable and its numbers mean nothing
};

/// Supply air that a run drew.
struct AirUse {
  double total_kg = 0;
  double steady_kg = 0;  ///< of it in the steady part
};

/// Evaluates a run; a solve that took longer than `deadline_us` is a miss.
Metrics evaluate_run(std::span<const TickRecord> ticks, const Trajectory& trajectory, double tick_s, const AirUse& air,
                     double deadline_us);

}  // namespace solenoid
