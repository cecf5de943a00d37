#include "experiments/tune/tune_report.hpp"

#include "experiments/base/gnuplot.hpp"
#include "experiments/base/text_table.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

std::size_t best_training(const TuneResult& result) {
  const auto least = std::ranges::min_element(result.steps, {}, [](const TuneStep& s) { return s.training.objective; });
  return static_cast<std::size_t>(least - result.steps.begin());
}

nlohmann::ordered_json json_of(const Score& s) {
  return {{"objective", s.objective},
          {"rmse_mm", s.rmse_mm},
          {"worst_rmse_mm", s.worst_rmse_mm},
          {"overshoot_percent", s.overshoot_percent},
          {"sse_mm", s.sse_mm},
          {"switches_per_s", s.switches_per_s},
          {"air_g", s.air_g},
          {"runs", s.runs},
          {"bad", s.bad}};
}

void add_row(TextTable& table, const std::string& name, const Score& s) {
  table.add_row(std::vector<std::string>{name, short_number(s.objective), short_number(s.rmse_mm),
                                         short_number(s.worst_rmse_mm), short_number(s.overshoot_percent),
                                         short_number(s.sse_mm), short_number(s.switches_per_s), short_number(s.air_g),
                                         fmt::format("{} of {}", s.bad, s.runs)});
}

}  // namespace

std::string tune_text(const TuneSettings& settings, const TuneResult& result, bool colour) {
  const TuneStep &before = result.steps.front(), &after = result.steps[result.chosen];
  TextTable scores({{settings.variant, TextTable::Align::left},
                    {"objective"},
                    {"RMSE mm"},
                    {"worst mm"},
                    {"overshoot %"},
                    {"SSE mm"},
                    {"switches/s"},
                    {"air g"},
                    {"bad runs"}});
  add_row(scores, "training, before", before.training);
  add_row(scores, "training, tuned", after.training);
  add_row(scores, "held out, before", *before.held_out);
  add_row(scores, "held out, tuned", *after.held_out);
  TextTable values({{"key", TextTable::Align::left}, {"before"}, {"tuned"}, {"low"}, {"high"}});
  for (std::size_t i = 0; i < settings.free.size(); ++i)
    values.add_row(std::vector<std::string>{
        settings.free[i].key, fmt::format("{:.4g}", before.values[i]), fmt::format("{:.4g}", after.values[i]),
        fmt::format("{:.4g}", settings.free[i].low), fmt::format("{:.4g}", settings.free[i].high)});
  return scores.text(colour) + "\n" + values.text(colour) +
         fmt::format(
             "\n{} steps, ended by {}; chosen: step {} (best in training: {}). Limits: {:.3g} switches/s, {:.3g} g\n"
             "Results: {}; judge it elsewhere: solenoid compare {}/tuned.toml\n",
             result.steps.size(), result.ended, result.chosen, best_training(result), result.limits.switches_per_s,
             result.limits.air_g, result.folder, result.folder);
}

std::string tune_json(const TuneSettings& settings, const TuneResult& result) {
  nlohmann::ordered_json json = {
      {"variant", settings.variant},
      {"campaign", settings.campaign},
      {"algorithm", settings.algorithm},
      {"ended", result.ended},
      {"chosen", result.chosen},
      {"limits", {{"switches_per_s", result.limits.switches_per_s}, {"air_g", result.limits.air_g}}},
      {"steps", nlohmann::ordered_json::array()}};
  for (const TuneStep& step : result.steps) {
    nlohmann::ordered_json one = {{"values", nlohmann::ordered_json::object()}, {"training", json_of(step.training)}};
    for (std::size_t i = 0; i < settings.free.size(); ++i) one["values"][settings.free[i].key] = step.values[i];
    if (step.held_out) one["held_out"] = json_of(*step.held_out);
    json["steps"].push_back(std::move(one));
  }
  return json.dump(1) + "\n";
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

void draw_tuning(const TuneResult& result, const std::string& path) {
  const bool svg = path.ends_with(".svg");
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
  const std::string script = fmt::format(R"(set terminal {}
set output 'figure'
set encoding utf8
set grid back lt 1 lw 0.7 lc rgb '#dddddd'
set border 3 lc rgb '#606060'
set tics nomirror out scale 0.5
set xlabel 'step'
set xrange [0:*]
set ylabel 'objective: ln(error), plus effort beyond the limits'
set key top right
set offsets 0, 0.5, graph 0.05, graph 0.05
set yrange [*:{}<*]
plot 'data' index 0 using 1:2 with points pt 7 ps 0.4 lc rgb '#9ecae1' title 'training', \
     'data' index 1 using 1:2 with steps lw 1.5 lc rgb '#1f77b4' title 'training, best so far', \
     'data' index 2 using 1:2 with linespoints pt 5 ps 0.6 lc rgb '#d95f02' title 'held out', \
     'data' index 3 using 1:2 with points pt 6 ps 2 lw 2 lc rgb '#d95f02' title 'chosen'
set output
)",
                                         svg ? "svg size 960,540 font 'Helvetica,13' background '#ffffff'"
                                             : "pngcairo size 960,540 font 'Sans,10' background '#ffffff'",
                                         result.steps.front().training.objective);
  draw_with_gnuplot({{"data", steps + "\n\n" + best + "\n\n" + held_out + "\n\n" + chosen}}, script, path);
}

}  // namespace solenoid
