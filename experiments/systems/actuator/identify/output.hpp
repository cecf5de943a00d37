#pragma once

#include "experiments/base/result.hpp"
#include "experiments/systems/actuator/identify/estimate.hpp"
#include "experiments/systems/actuator/identify/friction.hpp"
#include "experiments/systems/actuator/identify/record.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// Table of the estimates with their intervals, and beside them `truths` where there are any (a simulated plant's).
struct KnownTruth {
  std::string name;
  double value;
};
Result result_of(const Findings& found, const std::vector<KnownTruth>& truths);

/// The thesis's tables 4-1 and 4-2 by the same estimators.
std::string thesis_friction_text();

/// Measured and modelled above, residuals below.
Plot residuals(const ResidualPlot& plot);

}  // namespace solenoid
