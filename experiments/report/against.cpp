#include "experiments/report/against.hpp"

#include "core/config/reader.hpp"
#include "experiments/report/headings.hpp"
#include "experiments/report/paired.hpp"
#include "experiments/report/performance_profile.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr std::size_t most_ratios = 201;  // of a profile in data: each half per cent

const char* word_of(Paired::Verdict verdict) {
  switch (verdict) {
    case Paired::Verdict::better:
      return "better";
    case Paired::Verdict::worse:
      return "worse";
    case Paired::Verdict::no_difference_shown:
      break;
  }
  return "no difference shown";
}

std::vector<Table::Column> columns_of(const std::string& baseline) {
  return {{"variant", "variant", "<"},
          {"ratio", "ratio", ".4f"},
          {"own_low", ""},
          {"own_high", ""},
          {"low", "95 % from", ".4f"},
          {"high", "to", ".4f"},
          {"p", ""},
          {"better", "better in %", ".1f%"},
          {"tasks", "of tasks"},
          {"lost", "lost"},
          {"baseline_lost", "lost by " + baseline},
          {"verdict", "verdict", "<"}};
}

Table::Row row_of(const Paired& pair, const std::vector<std::string>& names) {
  const auto low = [](const std::optional<Paired::Interval>& i) { return i ? Json(i->low) : Json(); };
  const auto high = [](const std::optional<Paired::Interval>& i) { return i ? Json(i->high) : Json(); };
  return {names[pair.variant],
          pair.ratio,
          low(pair.own),
          high(pair.own),
          low(pair.corrected),
          high(pair.corrected),
          pair.p,
          pair.tasks > 0 ? Json(pair.better) : Json(),
          pair.tasks,
          pair.lost,
          pair.baseline_lost,
          pair.verdict ? Json(word_of(*pair.verdict)) : Json()};
}

const char* resampled(const PairedVariants& pairs) {
  return pairs.of_seeds()  ? (pairs.grouped() ? "groups of seeds" : "seeds")
         : pairs.grouped() ? "groups of scenarios"
                           : "scenarios";
}

/// What the columns are. `possible`: comparisons that there would be if each had an interval.
std::vector<std::string> notes_of(const PairedVariants& pairs, std::size_t comparisons, std::size_t possible,
                                  bool named) {
  const std::string counted =
      "better in: share of the tasks, scenarios with a seed, where the error is less, ties are halves; lost: tasks in "
      "no number, as the variant or the other did not end well.";
  const std::string needed = fmt::format(
      "{} scenarios, or seeds of one, and a ratio that differs in more than two of them", MaxT::least_values);
  if (!named && !pairs.every_pair())
    return {
        fmt::format("No corrected interval and no verdict: the best ranked of more than {} variants is not corrected "
                    "for. A baseline that is named before, with --against, has them.",
                    PairedVariants::most_variants),
        counted};
  if (comparisons == 0) return {fmt::format("No interval and no verdict: these take {}.", needed), counted};
  const bool all = comparisons == possible;
  const std::string joint = possible == 1 ? "of one comparison"
                                          : fmt::format("of {} {} together",
                                                        all ? fmt::format("all {}", possible)
                                                            : fmt::format("{} of {}", comparisons, possible),
                                                        named ? "comparisons" : "pairs of variants");
  std::vector<std::string> notes = {fmt::format(
      "95 %: {}, from {} resamples of the {} {}{}; better and worse where it is beyond 1.", joint, MaxT::resamples,
      pairs.units(), resampled(pairs), pairs.of_seeds() ? ", said of this scenario alone" : "")};
  if (!all) notes.push_back(fmt::format("The others have no verdict, which takes {}.", needed));
  notes.push_back(counted);
  return notes;
}

/// Numbers of the ranked variants in the table, best first.
std::vector<std::uint32_t> numbers_of(const RunTable& runs, const Ranking& ranking) {
  std::vector<std::uint32_t> numbers;
  for (const RankedVariant& v : ranking.variants)
    numbers.push_back(
        static_cast<std::uint32_t>(std::ranges::find(runs.variants(), v.variant) - runs.variants().begin()));
  return numbers;
}

Json matrix_json(const PairedFamily& all, const std::vector<std::string>& names) {
  Table table{.columns = columns_of("")};
  table.columns.insert(table.columns.begin(), Table::Column("baseline"));
  for (const Paired& pair : all.rows) {
    Table::Row row = row_of(pair, names);
    row.insert(row.begin(), Table::Cell(names[pair.baseline]));
    table.add(std::move(row));
  }
  return table.json();
}

Json profiles_json(const PairedVariants& pairs, const std::vector<std::uint32_t>& ranked,
                   const std::vector<std::string>& names) {
  const std::vector<PerformanceProfile> profiles = performance_profiles(pairs.errors(), most_ratios);
  Json list = Json::array();
  for (const std::uint32_t v : ranked)
    list.push_back(
        {{"variant", names[v]}, {"ok", profiles[v].ok}, {"runs", profiles[v].runs}, {"ratios", profiles[v].ratios}});
  return list;
}

}  // namespace

std::optional<Against> against(const RunTable& runs, const Ranking& ranking, const std::string& baseline,
                               std::optional<std::uint32_t> group) {
  const std::vector<std::uint32_t> ranked = numbers_of(runs, ranking);
  const std::vector<std::string>& names = runs.variants();
  const bool named = !baseline.empty();
  if (named && std::ranges::count(ranking.variants, baseline, &RankedVariant::variant) == 0) {
    std::vector<std::string> known;
    known.reserve(ranked.size());
    for (const std::uint32_t v : ranked) known.push_back(names[v]);
    throw ConfigError(fmt::format("baseline '{}' is not known (allowed: {})", baseline, fmt::join(known, ", ")));
  }
  if (ranked.size() < 2) return std::nullopt;
  const std::string base = named ? baseline : names[ranked.front()];
  const auto number = static_cast<std::uint32_t>(std::ranges::find(names, base) - names.begin());
  const PairedVariants pairs(runs, group, number);
  PairedFamily all = pairs.all();
  const std::size_t possible = named ? pairs.errors().variants() - 1 : all.rows.size() / 2;
  PairedFamily family = named ? pairs.against(number) : all;
  if (!pairs.every_pair()) std::erase_if(all.rows, [&](const Paired& pair) { return pair.baseline != number; });
  std::erase_if(family.rows, [&](const Paired& pair) { return pair.baseline != number; });
  const auto place = [&](std::uint32_t v) { return std::ranges::find(ranked, v); };
  for (PairedFamily* each : {&all, &family}) {
    std::erase_if(each->rows, [&](const Paired& pair) {
      return place(pair.variant) == ranked.end() || place(pair.baseline) == ranked.end();
    });
    std::ranges::sort(each->rows, {},
                      [&](const Paired& pair) { return std::pair(place(pair.baseline), place(pair.variant)); });
  }
  Against found{.table = {.title = fmt::format("{} of each run, divided by that of {} in the same scenario and seed",
                                               metric_heading(judged_metric(runs.system())).label, base),
                          .columns = columns_of(base)},
                .json = {}};
  for (const Paired& pair : family.rows) {
    found.several_tasks = found.several_tasks || pair.tasks > 1;
    found.table.add(row_of(pair, names));
  }
  found.table.notes = notes_of(pairs, family.comparisons, possible, named);
  found.json = {{"baseline", base},
                {"chosen", named ? "named" : "ranked first"},
                {"resampled", resampled(pairs)},
                {"units", pairs.units()},
                {"resamples", MaxT::resamples},
                {"comparisons", family.comparisons},
                {"notes", found.table.notes},
                {"variants", found.table.json()},
                {"matrix", matrix_json(all, names)},
                {"profiles", profiles_json(pairs, ranked, names)}};
  return found;
}

}  // namespace solenoid
