#pragma once

#include "experiments/identify/estimate.hpp"
#include "experiments/identify/friction.hpp"
#include "experiments/identify/record.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// Table of the estimates with their intervals, and beside them `truths` where there are any (a simulated plant's).
struct KnownTruth {
  std::string name;
  double value;
};
std::string identification_text(const Findings& found, const std::vector<KnownTruth>& truths, bool colour);
std::string identification_json(const Findings& found, const std::vector<KnownTruth>& truths);
std::string identification_csv(const Findings& found);

/// The thesis's tables 4-1 and 4-2 by the same estimators.
std::string thesis_friction_text();

/// Measured and modelled above, residuals below, as SVG.
void draw_residuals(const ResidualPlot& plot, const std::string& path);

}  // namespace solenoid
