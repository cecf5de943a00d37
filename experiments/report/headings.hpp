#pragma once

#include "core/system/description.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// A metric's heading, taken apart for those who set its unit elsewhere.
struct MetricHeading {
  std::string label;  ///< "RMSE"; of a metric without a heading the words of its key
  std::string unit;   ///< "mm"; none where the heading has none
  /// "RMSE, mm"
  std::string with_unit() const { return unit.empty() ? label : label + ", " + unit; }
};

/// Takes the heading's last word for its unit if the metric's key ends with it ("rmse_mm" and "RMSE mm"; "%" is
/// "percent").
MetricHeading metric_heading(const MetricColumn& metric);

/// The metric that a system's variants are ranked by. Throws std::logic_error if its description has none of that key.
const MetricColumn& judged_metric(const SystemDescription& system);

/// What control costs, in the order of the description.
std::vector<MetricColumn> effort_metrics(const SystemDescription& system);

/// A number as people read it: "0.1 kg", "1.5".
std::string value_text(double value, const std::string& unit);

/// "a", "a and b", "a, b and c".
std::string enumeration(const std::vector<std::string>& words);

}  // namespace solenoid
