#pragma once

#include "controllers/variant.hpp"
#include "core/systems/actuator/force_residual.hpp"
#include "experiments/systems/actuator/identify/record.hpp"

#include <vector>

namespace solenoid {

/// How well a variant's model predicts what records measured, without and with a residual in estimator and prediction.
struct PredictionError {
  static constexpr int ahead_ticks = 40;
  static constexpr int settled_ticks = 500;  ///< of a record, until its estimates are taken for predictions
  std::size_t predictions = 0;
  std::size_t records = 0;               ///< that they were made in
  double without_m = 0.0, with_m = 0.0;  ///< root mean square of the position's error after ahead_ticks; 0 of none
  bool better() const { return predictions > 0 && with_m < without_m; }  ///< with the residual
  double outside = 0.0;  ///< share of the ticks whose estimate is where no data were
};

/// From every tenth tick's estimate once it has settled: the recorded commands through the model, against the
/// measured position smoothed by a Gaussian of 4 ms. Records of another tick than the variant's, and those too
/// short to settle and be predicted in, are left out: of them alone there are no predictions.
PredictionError prediction_error(const std::vector<Record>& records, const VariantConfig& variant,
                                 const ForceResidual& residual);

}  // namespace solenoid
