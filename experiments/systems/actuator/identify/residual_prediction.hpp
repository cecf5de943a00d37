#pragma once

#include "controllers/variant.hpp"
#include "core/systems/actuator/force_residual.hpp"
#include "experiments/systems/actuator/identify/record.hpp"

#include <vector>

namespace solenoid {

/// How well a variant's model predicts what records measured, without and with a residual in estimator and prediction.
struct PredictionError {
  static constexpr int ahead_ticks = 40;
  std::size_t predictions = 0;
  double without_m = 0.0, with_m = 0.0;  ///< root mean square of the position's error after ahead_ticks
  bool worse() const { return predictions > 0 && with_m >= without_m; }  ///< with the residual
  double outside = 0.0;  ///< share of the ticks whose estimate is where no data were
};

/// From every tenth tick's estimate, the second half second on: the recorded commands through the model, against the
/// measured position smoothed by a Gaussian of 4 ms. Records of another tick than the variant's are left out.
PredictionError prediction_error(const std::vector<Record>& records, const VariantConfig& variant,
                                 const ForceResidual& residual);

}  // namespace solenoid
