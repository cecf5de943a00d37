#include "core/metrics/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace solenoid {

Percentiles percentiles(std::vector<double>& sample) {
  if (sample.empty()) return {};
  std::sort(sample.begin(), sample.end());
  const auto rank = [&](double p) {
    const double n = static_cast<double>(sample.size());
    return sample[static_cast<std::size_t>(std::clamp(std::ceil(p * n) - 1.0, 0.0, n - 1.0))];
  };
  return {rank(0.5), rank(0.9), rank(0.99), rank(0.999), sample.back()};
}

double& Metrics::operator[](std::string_view name) {
  const auto found = std::ranges::find(numbers_, name, &Number::name);
  if (found != numbers_.end()) return found->value;
  return numbers_.emplace_back(Number{std::string(name), 0.0}).value;
}

void Metrics::set(std::string_view name, double value) { (*this)[name] = value; }

double Metrics::number(std::string_view name) const {
  const auto found = std::ranges::find(numbers_, name, &Number::name);
  if (found == numbers_.end()) throw std::out_of_range("no metric '" + std::string(name) + "' of this run");
  return found->value;
}

bool Metrics::has(std::string_view name) const {
  return std::ranges::find(numbers_, name, &Number::name) != numbers_.end();
}

void add_solves(std::span<const TickRecord> ticks, double deadline_us, Metrics& m) {
  int solves = 0, proven = 0;
  std::vector<double> solve_us;
  for (const TickRecord& t : ticks) {
    if (!t.decision.solved) continue;
    ++solves;
    proven += t.decision.report.status == Status::optimal;
    m.deadline_misses += t.decision.report.time_us > deadline_us;
    solve_us.push_back(t.decision.report.time_us);
  }
  m.proven_optimal_fraction = solves ? static_cast<double>(proven) / solves : 0.0;
  m.solve_us = percentiles(solve_us);
}

}  // namespace solenoid
