#pragma once

#include "experiments/sim/simulate.hpp"

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace solenoid {

/// One number of the thesis's hardware tables beside ours.
struct FidelityCell {
  std::string table;      ///< "5-2" to "5-4", "7-1" to "7-9"
  std::string case_name;  ///< "np=120" or "vertical sine pd 0.15 kg"
  std::string metric;     ///< overshoot_percent | sse_mm | rmse_mm | mae_mm | ssa_mm
  double thesis = 0, ours = 0;
};

/// What stands in for the rig: `plant` is "twin" (with parameters) or "model" (the controller's own equations with
/// white sensor noise). Every run has measured sensing, noise and the thesis's estimator; the controller believes
/// `believed`.
struct FidelityRig {
  std::string plant = "twin";
  TwinParameters twin = nominal_twin();
  std::string believed = "inferred";
  double integral_gain = 0.005;            ///< K_ip of DMPC+I, per 1 ms sample
  std::vector<std::uint64_t> seeds = {1};  ///< a cell's value is the mean over these runs, as the thesis's over five
};

/// Tables 5-2 to 5-4: steps of 60 mm with DMPC and DMPC+I, cylinder alone. What the twin was chosen by.
std::vector<FidelityCell> chapter5_cells(const FidelityRig& rig);
/// Tables 7-1 to 7-9: cycloidal and sine, DMPC+I, cylinder alone and with the motor's PD law. Validation.
std::vector<FidelityCell> chapter7_cells(const FidelityRig& rig);

/// All errors are of the measured, filtered position (model.md, E13). Steady-state errors: largest absolute one in
/// chapter 5, as its tables say; absolute value of the mean in chapter 7 (E11).
struct MeasuredMetrics {
  double rmse_mm = 0, mae_mm = 0, sse_max_abs_mm = 0, sse_abs_mean_mm = 0, ssa_mm = 0, overshoot_percent = 0;
};
MeasuredMetrics measured_metrics(std::span<const TickRecord> ticks, const Trajectory& trajectory);

/// Mean of |ln(ours/thesis)| over the cells that `counted` accepts.
double mean_abs_log_ratio(std::span<const FidelityCell> cells, const std::function<bool(const FidelityCell&)>& counted);
/// Largest overshoot [%] of Table 5-2 from the given horizon on.
double largest_overshoot(std::span<const FidelityCell> cells, int from_np);

/// What the nominal twin was chosen by, small is good: mean |ln ratio| of the steady-state errors of tables 5-2 to 5-4
/// plus the mean difference of Table 5-2's overshoots in units of 10 %.
double choice_criterion(std::span<const FidelityCell> chapter5);

}  // namespace solenoid
