#include "experiments/report/against.hpp"

#include "core/config/reader.hpp"
#include "experiments/report/headings.hpp"
#include "experiments/report/ranking.hpp"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

using Task = std::pair<std::string, std::uint64_t>;  // scenario and seed

std::map<Task, double> judged_errors(std::span<const RunRecord> records, const std::string& variant) {
  std::map<Task, double> errors;
  for (const RunRecord& r : records)
    if (r.variant == variant && r.ok() && r.metrics)
      errors[{r.scenario, r.seed}] =
          std::max(r.metrics->number(judged_metric(description_of(r)).key), 1e-12);  // as rankings do
  return errors;
}

}  // namespace

std::optional<Table> against(std::span<const RunRecord> records, const std::string& baseline) {
  const Ranking ranking = rank_variants(records);
  std::vector<std::string> names;
  for (const RankedVariant& v : ranking.variants) names.push_back(v.variant);
  if (names.size() < 2) return std::nullopt;
  const std::string base = baseline.empty() ? names.front() : baseline;
  if (std::ranges::count(names, base) == 0)
    throw ConfigError(fmt::format("baseline '{}' is not known (allowed: {})", base, fmt::join(names, ", ")));
  const std::map<Task, double> base_errors = judged_errors(records, base);
  Table table{.title = fmt::format("{} of each run, divided by that of {} in the same scenario and seed",
                                   metric_heading(judged_metric(*ranking.system)).label, base),
              .columns = {{"variant", "variant", "<"},
                          {"ratio", "ratio", ".4f"},
                          {"ratio_low", "95 % from", ".4f"},
                          {"ratio_high", "to", ".4f"},
                          {"better", "better in"},
                          {"runs", "of"}}};
  bool any = false;
  for (const std::string& name : names) {
    if (name == base) continue;
    std::vector<double> ratios;
    for (const auto& [task, error] : judged_errors(records, name))
      if (const auto other = base_errors.find(task); other != base_errors.end())
        ratios.push_back(error / other->second);
    const auto better = std::ranges::count_if(ratios, [](double ratio) { return ratio < 1; });
    if (ratios.empty()) {
      table.add({name, nullptr, nullptr, nullptr, 0, 0});
      continue;
    }
    any = true;
    const GeometricMean mean = geometric_mean(ratios);
    const bool interval = ratios.size() > 1;
    table.add({name, mean.value, interval ? Json(mean.value / mean.margin) : Json(),
               interval ? Json(mean.value * mean.margin) : Json(), better, ratios.size()});
  }
  if (!any) return std::nullopt;
  return table;
}

}  // namespace solenoid
