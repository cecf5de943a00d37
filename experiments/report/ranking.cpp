#include "experiments/report/ranking.hpp"

#include "controllers/systems.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace solenoid {
namespace {

/// A yes or no a scenario.
using Marks = std::vector<bool>;

std::size_t marked(const Marks& marks) { return static_cast<std::size_t>(std::ranges::count(marks, true)); }

/// A variant of the table and what it finished.
struct Candidate {
  std::uint32_t variant = 0;
  Marks finished;  ///< the scenarios where every one of its runs ended well
};

/// What a ranking is of: the rows of a table, in its order, that belong to a group or to any.
class Rows {
 public:
  Rows(const RunTable& runs, std::optional<std::uint32_t> group) : runs_(runs), group_(group) {}

  void each(const auto& take) const {
    const auto [first, end] = runs_.rows(group_);
    for (std::size_t row = first; row < end; ++row)
      if (!group_ || runs_.group(row) == *group_) take(row);
  }

 private:
  const RunTable& runs_;
  std::optional<std::uint32_t> group_;
};

/// In the order in which the variants come up.
std::vector<Candidate> candidates_of(const RunTable& runs, const Rows& rows) {
  std::vector<Candidate> candidates;
  std::vector<std::optional<std::size_t>> places(runs.variants().size());
  std::vector<Marks> troubled;
  rows.each([&](std::size_t row) {
    std::optional<std::size_t>& place = places[runs.variant(row)];
    if (!place) {
      place = candidates.size();
      candidates.push_back({runs.variant(row), Marks(runs.scenarios())});
      troubled.emplace_back(runs.scenarios());
    }
    (runs.ok(row) ? candidates[*place].finished : troubled[*place])[runs.scenario(row)] = true;
  });
  for (std::size_t c = 0; c < candidates.size(); ++c)
    for (std::size_t s = 0; s < runs.scenarios(); ++s)
      if (troubled[c][s]) candidates[c].finished[s] = false;
  return candidates;
}

Marks common_to_all(const std::vector<Candidate>& candidates, std::size_t scenarios) {
  Marks common(scenarios, !candidates.empty());
  for (const Candidate& candidate : candidates)
    for (std::size_t s = 0; s < scenarios; ++s) common[s] = common[s] && candidate.finished[s];
  return common;
}

/// Leaves the candidates that are worth comparing; returns their common scenarios.
Marks choose(std::vector<Candidate>& candidates, const RunTable& runs) {
  const auto finished = [](const Candidate& candidate) { return marked(candidate.finished); };
  std::size_t most = 0;
  for (const Candidate& candidate : candidates) most = std::max(most, finished(candidate));
  std::erase_if(candidates, [&](const Candidate& c) { return finished(c) == 0 || 2 * finished(c) < most; });
  Marks common = common_to_all(candidates, runs.scenarios());
  while (marked(common) == 0 && !candidates.empty()) {
    // Of several the first by name.
    const auto fewest = std::ranges::min_element(
        candidates, {}, [&](const Candidate& c) { return std::pair(finished(c), runs.variants()[c.variant]); });
    candidates.erase(fewest);
    common = common_to_all(candidates, runs.scenarios());
  }
  return common;
}

/// Geometric mean with its interval, 95th percentile and worst.
void summarise_errors(std::vector<double> errors, RankedVariant& v) {
  const auto n = static_cast<double>(errors.size());
  const GeometricMean mean = geometric_mean(errors);
  v.error = mean.value;
  v.margin = mean.margin;
  std::ranges::sort(errors);
  v.p95 = errors[static_cast<std::size_t>(std::ceil(0.95 * n)) - 1];
  v.worst = errors.back();
}

void summarise(const RunTable& runs, const Rows& rows, const Marks& common, std::uint32_t variant, RankedVariant& v) {
  v.efforts.assign(runs.efforts(), 0.0);
  std::vector<double> errors, medians;
  rows.each([&](std::size_t row) {
    if (runs.variant(row) != variant || !runs.ok(row) || !common[runs.scenario(row)]) return;
    errors.push_back(runs.error(row));
    for (std::size_t i = 0; i < runs.efforts(); ++i) v.efforts[i] += runs.effort(row, i);
    v.solve_p99_us = std::max(v.solve_p99_us, runs.solve_p99_us(row));
    medians.push_back(runs.solve_p50_us(row));
  });
  for (double& effort : v.efforts) effort /= static_cast<double>(errors.size());
  summarise_errors(std::move(errors), v);
  v.solve_p50_us = percentiles(medians).p50;
}

}  // namespace

GeometricMean geometric_mean(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  double sum = 0, squares = 0;
  for (const double e : values) sum += std::log(e);
  for (const double e : values) squares += (std::log(e) - sum / n) * (std::log(e) - sum / n);
  return {std::exp(sum / n), values.size() > 1 ? std::exp(1.96 * std::sqrt(squares / (n - 1) / n)) : 1.0};
}

Ranking rank_variants(const RunTable& runs, std::optional<std::uint32_t> group) {
  const Rows rows(runs, group);
  Ranking ranking;
  ranking.system = &runs.system();
  std::vector<Candidate> candidates = candidates_of(runs, rows);
  std::vector<std::size_t> places(runs.variants().size());
  for (const Candidate& candidate : candidates) {
    places[candidate.variant] = ranking.variants.size();
    ranking.variants.emplace_back().variant = runs.variants()[candidate.variant];
  }
  Marks seen(runs.scenarios());
  rows.each([&](std::size_t row) {
    RankedVariant& v = ranking.variants[places[runs.variant(row)]];
    ++v.runs;
    v.failed += runs.failed(row);
    v.unstable += !runs.failed(row) && !runs.ok(row);
    seen[runs.scenario(row)] = true;
  });
  const Marks common = choose(candidates, runs);
  for (const Candidate& candidate : candidates) {
    RankedVariant& v = ranking.variants[places[candidate.variant]];
    v.ranked = true;
    summarise(runs, rows, common, candidate.variant, v);
  }
  std::ranges::stable_sort(ranking.variants, [](const RankedVariant& a, const RankedVariant& b) {
    return a.ranked != b.ranked ? a.ranked : a.ranked && a.error < b.error;
  });
  ranking.common_scenarios = marked(common);
  ranking.scenarios = marked(seen);
  return ranking;
}

Ranking rank_variants(std::span<const RunRecord> records) { return rank_variants(tables_of(records).front()); }

}  // namespace solenoid
