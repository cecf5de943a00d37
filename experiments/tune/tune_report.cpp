#include "experiments/tune/tune_report.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/result.hpp"
#include "experiments/report/headings.hpp"

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
Table scores(const std::string& variant, const SystemDescription& system,
             const std::vector<std::pair<std::string, Score>>& rows) {
  const bool steps = has_step_metrics(system);
  Table table{.columns = {Column("", variant, "<"), Column("objective", "objective"),
                          Column(system.judged.metric, judged_metric(system).heading),
                          Column("worst_" + system.judged.metric, "worst")}};
  if (steps)
    table.columns.insert(table.columns.end(), {Column("overshoot_percent", "overshoot %"), Column("sse_mm", "SSE mm")});
  for (const MetricColumn& effort : effort_metrics(system)) table.columns.push_back(Column(effort.key, effort.heading));
  table.columns.insert(table.columns.end(), {Column("runs", "runs"), Column("bad", "bad")});
  for (const auto& [name, s] : rows) {
    Table::Row row = {name, s.objective, s.error, s.worst_error};
    if (steps) row.insert(row.end(), {s.overshoot_percent, s.sse_mm});
    std::vector<double> efforts = s.efforts;
    efforts.resize(effort_metrics(system).size());
    row.insert(row.end(), efforts.begin(), efforts.end());
    row.insert(row.end(), {s.runs, s.bad});
    table.add(std::move(row));
  }
  return table;
}

Json json_of(const Score& score, const SystemDescription& system) {
  return scores("", system, {{"", score}}).json().front();
}

/// "3.1 switches/s, 2 air g" of the efforts.
std::string efforts_text(const std::vector<double>& values, const SystemDescription& system) {
  const std::vector<MetricColumn> efforts = effort_metrics(system);
  std::string text;
  for (std::size_t i = 0; i < std::min(values.size(), efforts.size()); ++i)
    text += fmt::format("{}{} {:.3g}", i ? ", " : "", efforts[i].heading, values[i]);
  return text;
}

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
  Json steps = Json::array(), limits = Json::object();
  const std::vector<MetricColumn> efforts = effort_metrics(*result.system);
  for (std::size_t i = 0; i < result.limits.size(); ++i) limits[efforts[i].key] = result.limits[i];
  for (const TuneStep& step : result.steps) {
    Json one = {{"values", Json::object()}, {"training", json_of(step.training, *result.system)}};
    for (std::size_t i = 0; i < settings.free.size(); ++i) one["values"][settings.free[i].key] = step.values[i];
    if (step.held_out) one["held_out"] = json_of(*step.held_out, *result.system);
    steps.push_back(std::move(one));
  }
  return {.facts = {{"variant", settings.variant},
                    {"campaign", settings.campaign},
                    {"algorithm", settings.algorithm},
                    {"ended", result.ended},
                    {"chosen", result.chosen},
                    {"limits", limits},
                    {"steps", steps}},
          .tables = {scores(settings.variant, *result.system,
                            {{"training, before", before.training},
                             {"training, tuned", after.training},
                             {"held out, before", *before.held_out},
                             {"held out, tuned", *after.held_out}}),
                     values},
          .notes = {fmt::format("{} steps, ended by {}; chosen: step {} (best in training: {}). Limits: {}",
                                result.steps.size(), result.ended, result.chosen, best_training(result),
                                efforts_text(result.limits, *result.system)),
                    fmt::format("Results: {}; judge it elsewhere: solenoid compare {}/tuned.toml", result.folder,
                                result.folder)},
          .plot = plot_of(result)};
}

std::string draw_history(const TuneResult& result) {
  try {
    draw(plot_of(result), result.folder + "/history.svg");
    return {};
  } catch (const ConfigError& error) {
    return error.what();
  }
}

std::string tune_progress(const TuneSettings& settings, const TuneResult& result) {
  const std::size_t step = result.steps.size() - 1;
  const Score& s = result.steps[step].training;
  std::string values;
  for (std::size_t i = 0; i < settings.free.size(); ++i)
    values += fmt::format(" {}={:.3g}", settings.free[i].key, result.steps[step].values[i]);
  return fmt::format("step {} of {}: objective {:.3f}, {} {:.4g}, {}; best {} |{}", step, settings.evaluations,
                     s.objective, result.system->judged.metric, s.error, efforts_text(s.efforts, *result.system),
                     best_training(result), values);
}

}  // namespace solenoid
