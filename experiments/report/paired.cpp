#include "experiments/report/paired.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

namespace solenoid {
namespace {

constexpr double no_spread = 1e-12;  // of a standard error of logarithms: rounding

/// Values of the linearised ratio of two sums over units, less itself, as far as a unit has tasks:
/// (sum - mean count) k / n.
std::vector<double> centred(const std::vector<double>& sums, const std::vector<double>& counts, double mean) {
  std::vector<double> values;
  double tasks = 0;
  for (std::size_t u = 0; u < sums.size(); ++u) {
    if (counts[u] == 0) continue;
    values.push_back(sums[u] - mean * counts[u]);
    tasks += counts[u];
  }
  for (double& value : values) value *= static_cast<double>(values.size()) / tasks;
  return values;
}

double standard_error(const std::vector<double>& values) {
  const auto k = static_cast<double>(values.size());
  double squares = 0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / (k * (k - 1)));
}

std::optional<Paired::Interval> interval(double log_ratio, double margin) {
  if (!std::isfinite(margin)) return std::nullopt;
  return Paired::Interval{std::exp(log_ratio - margin), std::exp(log_ratio + margin)};
}

}  // namespace

PairedVariants::PairedVariants(const RunTable& runs, std::optional<std::uint32_t> group,
                               std::optional<std::uint32_t> baseline)
    : errors_(runs, group) {
  units_ = std::min(of_seeds() ? errors_.tasks() : errors_.scenarios(), most_units);
  std::vector<double> logs(errors_.tasks() * errors_.variants());
  for (std::size_t task = 0; task < errors_.tasks(); ++task)
    for (std::size_t v = 0; v < errors_.variants(); ++v)
      if (errors_.ok(task, v)) logs[task * errors_.variants() + v] = std::log(errors_.error(task, v));
  std::vector<std::uint32_t> by_name(errors_.variants());
  std::iota(by_name.begin(), by_name.end(), 0u);
  std::ranges::sort(by_name, {}, [&](std::uint32_t v) -> const std::string& { return runs.variants()[v]; });
  std::vector<std::vector<double>> means;
  for (auto b = by_name.begin(); b != by_name.end(); ++b)
    for (auto a = by_name.begin(); a != b; ++a) {
      if (!every_pair() && *a != baseline && *b != baseline) continue;
      Pair& pair = pairs_.emplace_back(Pair{.a = *a, .b = *b});
      std::vector<double> values = compare(pair, logs);
      if (values.size() < MaxT::least_values) continue;
      pair.error = standard_error(values);
      if (pair.error <= no_spread) continue;
      pair.mean = means.size();
      means.push_back(std::move(values));
    }
  if (means.empty()) return;
  resampled_.emplace(means);
  for (std::size_t mean = 0; mean < means.size(); ++mean) critical_.push_back(resampled_->critical(mean));
}

std::size_t PairedVariants::unit(std::size_t task) const {
  const std::size_t all = of_seeds() ? errors_.tasks() : errors_.scenarios();
  return (of_seeds() ? task : errors_.scenario(task)) * units_ / all;
}

/// What the tasks say of a pair; its values for MaxT.
std::vector<double> PairedVariants::compare(Pair& pair, const std::vector<double>& logs) const {
  std::vector<double> sums(units_), counts(units_);
  double wins = 0, sum = 0;
  for (std::size_t task = 0; task < errors_.tasks(); ++task) {
    const bool ok_a = errors_.ok(task, pair.a), ok_b = errors_.ok(task, pair.b);
    if (ok_a && ok_b) {
      const double a = errors_.error(task, pair.a), b = errors_.error(task, pair.b);
      const double log_ratio = logs[task * errors_.variants() + pair.a] - logs[task * errors_.variants() + pair.b];
      sums[unit(task)] += log_ratio;
      counts[unit(task)] += 1;
      sum += log_ratio;
      wins += a < b ? 1.0 : a == b ? 0.5 : 0.0;
      ++pair.tasks;
    } else if (errors_.ran(task, pair.a) && errors_.ran(task, pair.b)) {
      pair.lost_a += !ok_a;
      pair.lost_b += !ok_b;
    }
  }
  if (pair.tasks == 0) return {};
  pair.better = wins / static_cast<double>(pair.tasks);
  pair.log_ratio = sum / static_cast<double>(pair.tasks);
  return centred(sums, counts, pair.log_ratio);
}

Paired PairedVariants::paired(const Pair& pair, bool turned, const Together& together) const {
  const double log_ratio = turned ? -pair.log_ratio : pair.log_ratio;
  const bool any = pair.tasks > 0;
  Paired found{.variant = turned ? pair.b : pair.a,
               .baseline = turned ? pair.a : pair.b,
               .tasks = pair.tasks,
               .lost = turned ? pair.lost_b : pair.lost_a,
               .baseline_lost = turned ? pair.lost_a : pair.lost_b,
               .ratio = any ? std::exp(log_ratio) : std::numeric_limits<double>::quiet_NaN(),
               .better = turned && any ? 1 - pair.better : pair.better};
  if (!pair.mean) return found;
  found.own = interval(log_ratio, pair.error * critical_[*pair.mean]);
  if (!std::ranges::binary_search(together.means, *pair.mean)) return found;
  found.corrected = interval(log_ratio, pair.error * together.family->critical());
  found.p = together.family->p(std::abs(log_ratio) / pair.error);
  found.verdict = found.corrected->high < 1  ? Paired::Verdict::better
                  : found.corrected->low > 1 ? Paired::Verdict::worse
                                             : Paired::Verdict::no_difference_shown;
  return found;
}

PairedVariants::Together PairedVariants::together(const std::vector<std::size_t>& pairs) const {
  Together found;
  for (const std::size_t pair : pairs)
    if (pairs_[pair].mean) found.means.push_back(*pairs_[pair].mean);
  if (found.means.empty()) return found;
  MaxT::Family family = resampled_->bounded_family(found.means);
  if (!found.means.empty()) found.family = std::move(family);
  return found;
}

PairedFamily PairedVariants::against(std::uint32_t baseline) const {
  std::vector<std::size_t> own;
  for (std::size_t i = 0; i < pairs_.size(); ++i)
    if (pairs_[i].a == baseline || pairs_[i].b == baseline) own.push_back(i);
  const Together corrected = together(own);
  PairedFamily found{.rows = {}, .comparisons = corrected.means.size()};
  for (const std::size_t i : own) found.rows.push_back(paired(pairs_[i], pairs_[i].a == baseline, corrected));
  std::ranges::sort(found.rows, {}, &Paired::variant);
  return found;
}

PairedFamily PairedVariants::all() const {
  std::vector<std::size_t> every(pairs_.size());
  for (std::size_t i = 0; i < every.size(); ++i) every[i] = i;
  const Together corrected = every_pair() ? together(every) : Together{};
  PairedFamily found{.rows = {}, .comparisons = corrected.means.size()};
  for (const Pair& pair : pairs_)
    for (const bool turned : {false, true}) found.rows.push_back(paired(pair, turned, corrected));
  std::ranges::sort(found.rows, {}, [](const Paired& row) { return std::pair(row.baseline, row.variant); });
  return found;
}

}  // namespace solenoid
