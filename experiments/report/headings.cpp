#include "experiments/report/headings.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {

MetricHeading metric_heading(const MetricColumn& metric) {
  if (metric.heading.empty()) {
    if (!metric.meaning.empty()) return {metric.meaning, ""};
    std::string words = metric.key;
    std::ranges::replace(words, '_', ' ');
    return {words, ""};
  }
  const std::size_t space = metric.heading.rfind(' ');
  if (space == std::string::npos) return {metric.heading, ""};
  const std::string unit = metric.heading.substr(space + 1);
  if (!metric.key.ends_with("_" + unit_in_keys(unit))) return {metric.heading, ""};
  return {metric.heading.substr(0, space), unit};
}

const MetricColumn& judged_metric(const SystemDescription& system) {
  const auto found = std::ranges::find(system.metrics, system.judged.metric, &MetricColumn::key);
  if (found == system.metrics.end())
    throw std::logic_error(fmt::format("the system '{}' is judged by '{}', which is none of its metrics", system.name,
                                       system.judged.metric));
  return *found;
}

std::vector<MetricColumn> effort_metrics(const SystemDescription& system) {
  std::vector<MetricColumn> efforts;
  std::ranges::copy_if(system.metrics, std::back_inserter(efforts), &MetricColumn::effort);
  return efforts;
}

std::string value_text(double value, const std::string& unit) {
  return unit.empty() ? fmt::format("{}", value) : fmt::format("{} {}", value, unit);
}

std::string enumeration(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i)
    text += (i == 0 ? "" : i + 1 < words.size() ? ", " : " and ") + words[i];
  return text;
}

}  // namespace solenoid
