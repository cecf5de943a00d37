#include "experiments/tune/tune_report.hpp"

#include "experiments/base/result.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Column = Table::Column;

std::size_t best_training(const TuneResult& result) {
  const auto least = std::ranges::min_element(result.steps, {}, [](const TuneStep& s) { return s.training.objective; });
  return static_cast<std::size_t>(least - result.steps.begin());
}

/// Scores, a row each, under their names.
Table scores(const std::string& variant, const std::vector<std::pair<std::string, Score>>& rows) {
  Table table{.columns = {Column("", variant, "<"), Column("objective", "objective"), Column("rmse_mm", "RMSE mm"),
                          Column("worst_rmse_mm", "worst mm"), Column("overshoot_percent", "overshoot %"),
                          Column("sse_mm", "SSE mm"), Column("switches_per_s", "switches/s"), Column("air_g", "air g"),
                          Column("runs", "runs"), Column("bad", "bad")}};
  for (const auto& [name, s] : rows)
    table.add({name, s.objective, s.rmse_mm, s.worst_rmse_mm, s.overshoot_percent, s.sse_mm, s.switches_per_s, s.air_g,
               s.runs, s.bad});
  return table;
}

Json json_of(const Score& score) { return scores("", {{"", score}}).json().front(); }

/// Objective against step: the training's with its best so far, the held-out's and what was chosen.
Plot plot_of(const TuneResult& result) {
  std::string steps, best, held_out;
  double least = result.steps.front().training.objective;
  for (std::size_t i = 0; i < result.steps.size(); ++i) {
    const TuneStep& s = result.steps[i];
    least = std::min(least, s.training.objective);
    steps += fmt::format("{} {}\n", i, s.training.objective);
    best += fmt::format("{} {}\n", i, least);
    if (s.held_out) held_out += fmt::format("{} {}\n", i, s.held_out->objective);
  }
  const std::string chosen = fmt::format("{} {}\n", result.chosen, result.steps[result.chosen].held_out->objective);
  return {.width = 960,
          .height = 540,
          .settings = fmt::format("set xlabel 'step'\nset xrange [0:*]\nset ylabel 'objective: ln(error), plus effort "
                                  "beyond the limits'\nset key top right\nset offsets 0, 0.5, graph 0.05, graph "
                                  "0.05\nset yrange [*:{}<*]\n",
                                  result.steps.front().training.objective),
          .panels = {{"",
                      steps + "\n\n" + best + "\n\n" + held_out + "\n\n" + chosen,
                      {{"index 0 using 1:2 with points pt 7 ps 0.4 lc rgb '#9ecae1'", "training"},
                       {"index 1 using 1:2 with steps lw 1.5 lc rgb '#1f77b4'", "training, best so far"},
                       {"index 2 using 1:2 with linespoints pt 5 ps 0.6 lc rgb '#d95f02'", "held out"},
                       {"index 3 using 1:2 with points pt 6 ps 2 lw 2 lc rgb '#d95f02'", "chosen"}}}}};
}

}  // namespace

Result result_of(const TuneSettings& settings, const TuneResult& result) {
  const TuneStep &before = result.steps.front(), &after = result.steps[result.chosen];
  Table values{.columns = {Column("", "key", "<"), Column("", "before", ".4g"), Column("", "tuned", ".4g"),
                           Column("", "low", ".4g"), Column("", "high", ".4g")}};
  for (std::size_t i = 0; i < settings.free.size(); ++i)
    values.add({settings.free[i].key, before.values[i], after.values[i], settings.free[i].low, settings.free[i].high});
  Json steps = Json::array();
  for (const TuneStep& step : result.steps) {
    Json one = {{"values", Json::object()}, {"training", json_of(step.training)}};
    for (std::size_t i = 0; i < settings.free.size(); ++i) one["values"][settings.free[i].key] = step.values[i];
    if (step.held_out) one["held_out"] = json_of(*step.held_out);
    steps.push_back(std::move(one));
  }
  return {.facts = {{"variant", settings.variant},
                    {"campaign", settings.campaign},
                    {"algorithm", settings.algorithm},
                    {"ended", result.ended},
                    {"chosen", result.chosen},
                    {"limits", {{"switches_per_s", result.limits.switches_per_s}, {"air_g", result.limits.air_g}}},
                    {"steps", steps}},
          .tables = {scores(settings.variant, {{"training, before", before.training},
                                               {"training, tuned", after.training},
                                               {"held out, before", *before.held_out},
                                               {"held out, tuned", *after.held_out}}),
                     values},
          .notes = {fmt::format("{} steps, ended by {}; chosen: step {} (best in training: {}). Limits: {:.3g} "
                                "switches/s, {:.3g} g",
                                result.steps.size(), result.ended, result.chosen, best_training(result),
                                result.limits.switches_per_s, result.limits.air_g),
                    fmt::format("Results: {}; judge it elsewhere: solenoid compare {}/tuned.toml", result.folder,
                                result.folder)},
          .plot = plot_of(result)};
}

std::string tune_progress(const TuneSettings& settings, const TuneResult& result) {
  const std::size_t step = result.steps.size() - 1;
  const Score& s = result.steps[step].training;
  std::string values;
  for (std::size_t i = 0; i < settings.free.size(); ++i)
    values += fmt::format(" {}={:.3g}", settings.free[i].key, result.steps[step].values[i]);
  return fmt::format(
      "step {} of {}: objective {:.3f}, RMSE {:.4f} mm, overshoot {:.1f} %, SSE {:.3f} mm, {:.1f} switches/s, {:.2f} "
      "g; "
      "best {} |{}",
      step, settings.evaluations, s.objective, s.rmse_mm, s.overshoot_percent, s.sse_mm, s.switches_per_s, s.air_g,
      best_training(result), values);
}

}  // namespace solenoid
