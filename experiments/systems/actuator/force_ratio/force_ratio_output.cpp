#include "experiments/base/result.hpp"
#include "experiments/systems/actuator/force_ratio/force_ratio.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

using Column = Table::Column;

std::vector<RatioMeasured> measured_of(const RatioStudy& study) {
  std::vector<RatioMeasured> measured;
  for (const RatioResult& r : study.ratios) measured.push_back(r.measured);
  return measured;
}

std::string share_text(double share) { return fmt::format("{:.3g}", share); }

/// Cylinder force to motor force, as the thesis speaks of it.
std::string ratio_text(const RatioDesign& d) {
  if (!d.has_motor()) return "cylinder";
  if (!d.has_cylinder()) return "motor";
  const double ratio = d.cylinder_n / d.motor_n;
  return ratio >= 1 ? fmt::format("{:.3g}:1", ratio) : fmt::format("1:{:.3g}", 1 / ratio);
}

Table designs(const RatioStudy& study) {
  Table table{.name = "ratios",
              .title = "Cylinder and motor at equal capability, their largest forces' sum:",
              .columns = {Column("share", "motor's share", ".3g"), Column("", "ratio"),
                          Column("bore_mm", "bore mm", ".2f"), Column("cylinder_n", "cylinder N", ".1f"),
                          Column("motor_n", "motor N", ".1f"), Column("motor_torque_nm", "motor N m", ".3g"),
                          Column("pinion_mm", "pinion mm", ".3g"), Column("", "tooth safety", ".3g"),
                          Column("mass_kg", "mass kg", ".2f"), Column("price", "price", ".0f")}};
  for (const RatioResult& r : study.ratios) {
    const RatioDesign& d = r.design;
    table.add({d.share, ratio_text(d), 1e3 * d.bore_m, d.cylinder_n, d.motor_n, d.motor_torque_nm, 1e3 * d.pinion_m,
               d.has_motor() ? Json(d.pinion_safety) : Json(), d.mass_kg, d.price});
  }
  return table;
}

Table measures(const RatioStudy& study) {
  Table table{
      .name = "ratios",
      .title = "Each tuned and judged on plants it has not seen; means of a run, energies of its air and motor:",
      .columns = {Column("", "motor's share", ".3g"), Column("law", "law", "<"),
                  Column("tuned", "", "", Table::Data::json), Column("evaluations"),
                  Column("rmse_mm", "RMSE mm", ".4f"), Column("rmse_margin"), Column("", "+- %", ".0f%"),
                  Column("worst_rmse_mm", "worst mm", ".3f"), Column("switches_per_s", "switches/s", ".1f"),
                  Column("air_g", "air g", ".3f"), Column("motor_rms_n"), Column("electric_j", "electric J", ".2f"),
                  Column("air_j", "air J", ".2f"), Column("energy_j", "energy J", ".2f"), Column("front", "front", "<"),
                  Column("score", "score", ".2f"), Column("runs", "runs"), Column("bad", "bad")}};
  const std::vector<RatioCriteria> criteria = criteria_of(study, study.assumptions);
  const std::vector<bool> front = efficient(criteria);
  const int best = recommended(criteria, measured_of(study));
  for (std::size_t i = 0; i < study.ratios.size(); ++i) {
    const RatioResult& r = study.ratios[i];
    const RatioMeasured& m = r.measured;
    const RatioCriteria& c = criteria[i];
    Json tuned = Json::object();
    for (const auto& [key, value] : r.tuned) tuned[key] = value;
    table.add({r.design.share,
               r.law,
               tuned,
               r.evaluations,
               m.rmse_mm,
               m.rmse_margin,
               m.rmse_margin - 1,
               m.worst_rmse_mm,
               m.switches_per_s,
               m.air_g,
               m.motor_rms_n,
               c.electric_j,
               c.air_j,
               c.energy_j(),
               static_cast<bool>(front[i]),
               {c.score, static_cast<int>(i) == best},
               m.runs,
               m.bad});
  }
  return table;
}

/// The share of the least score among those with cylinder and motor.
std::optional<double> best_hybrid(const RatioStudy& study, const std::vector<RatioCriteria>& criteria) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < criteria.size(); ++i) {
    const RatioResult& r = study.ratios[i];
    if (!r.design.has_cylinder() || !r.design.has_motor() || r.measured.bad > 0) continue;
    if (!best || criteria[i].score < criteria[*best].score) best = i;
  }
  return best ? std::optional(study.ratios[*best].design.share) : std::nullopt;
}

/// Shares whose score differs from the best one's by less than the errors' intervals can.
std::string not_told_apart(const RatioStudy& study) {
  const std::vector<RatioCriteria> criteria = criteria_of(study, study.assumptions);
  const int best = recommended(criteria, measured_of(study));
  if (best < 0) return {};
  const auto b = static_cast<std::size_t>(best);
  std::vector<std::string> close;
  for (std::size_t i = 0; i < criteria.size(); ++i) {
    const double doubt = study.assumptions.weight_error *
                         std::log(study.ratios[i].measured.rmse_margin * study.ratios[b].measured.rmse_margin);
    if (i != b && study.ratios[i].measured.bad == 0 && criteria[i].score - criteria[b].score < doubt)
      close.push_back(share_text(study.ratios[i].design.share));
  }
  return close.empty() ? "" : fmt::format("{}", fmt::join(close, ", "));
}

/// What is recommended, and under each change of the assumptions.
Table verdicts_table(const RatioStudy& study) {
  Table table{
      .name = "verdicts",
      .columns = {Column("change"), Column("", "assumption changed", "<"), Column("share", "recommended share", ".3g"),
                  Column("lead", "lead", ".2f"), Column("hybrid_share", "best hybrid", ".3g")}};
  const std::vector<RatioVerdict> verdicts = verdicts_of(study);
  if (verdicts.empty()) {
    table.title = "No ratio stands: in each a run ended badly.";
    return table;
  }
  const RatioVerdict& now = verdicts.front();
  table.title = fmt::format("Recommended: a motor's share of {}, its score {:.2f} ahead of the next.",
                            share_text(now.share), now.lead);
  if (now.hybrid_share)
    table.title += fmt::format("\nAmong those with cylinder and motor: {}.", share_text(*now.hybrid_share));
  if (const std::string close = not_told_apart(study); !close.empty())
    table.title += "\nNot told apart from the recommended by the errors' 95 % intervals: " + close + ".";
  for (const RatioVerdict& v : verdicts)
    table.add({v.change, v.change.empty() ? "none" : v.change, v.share, v.lead, v.hybrid_share});
  const auto same = std::ranges::count(verdicts, now.share, &RatioVerdict::share) - 1,
             same_hybrid = std::ranges::count(verdicts, now.hybrid_share, &RatioVerdict::hybrid_share) - 1;
  table.notes = {fmt::format("The recommendation stays in {0} of {2} changes, the best hybrid in {1} of {2}.", same,
                             same_hybrid, verdicts.size() - 1)};
  return table;
}

struct Panel {
  const char* label;
  double (*cost)(const RatioCriteria&);
};
constexpr Panel panels[] = {{"price of the drive", [](const RatioCriteria& c) { return c.price; }},
                            {"mass of the drive, kg", [](const RatioCriteria& c) { return c.mass_kg; }},
                            {"energy of a run, J", [](const RatioCriteria& c) { return c.energy_j(); }}};

/// Lines `cost rmse low high "share"`; below, apart, the front as a staircase, and the recommended points: of all, of
/// the hybrids.
std::string panel_data(const RatioStudy& study, const Panel& panel) {
  const std::vector<RatioCriteria> criteria = criteria_of(study, study.assumptions);
  std::vector<std::size_t> order(criteria.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](std::size_t i) { return panel.cost(criteria[i]); });
  std::string points, front;
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    const RatioMeasured& m = study.ratios[i].measured;
    const double cost = panel.cost(criteria[i]);
    points += fmt::format("{} {} {} {} \"{}\"\n", cost, m.rmse_mm, m.rmse_mm / m.rmse_margin, m.rmse_mm * m.rmse_margin,
                          share_text(study.ratios[i].design.share));
    if (m.rmse_mm >= least) continue;
    least = m.rmse_mm;
    front += fmt::format("{} {}\n", cost, least);
  }
  std::string marks;
  const auto verdicts = verdicts_of(study);
  for (std::size_t i = 0; i < criteria.size() && !verdicts.empty(); ++i) {
    const std::string mark = fmt::format("{} {}\n", panel.cost(criteria[i]), criteria[i].error_mm);
    const double share = study.ratios[i].design.share;
    if (share == verdicts.front().share) marks = mark + marks;
    if (share == verdicts.front().hybrid_share) marks += mark;
  }
  return points + "\n\n" + front + "\n\n" + marks;
}

/// Error against price, mass and energy with the fronts.
Plot plot_of(const RatioStudy& study) {
  double low = std::numeric_limits<double>::infinity(), high = 0.0;
  for (const RatioResult& r : study.ratios) {
    low = std::min(low, r.measured.rmse_mm / r.measured.rmse_margin);
    high = std::max(high, r.measured.rmse_mm * r.measured.rmse_margin);
  }
  Plot plot{.width = 1280,
            .height = 440,
            .title =
                "error against price, mass and energy; labels: the motor's share; circle: recommended, triangle: "
                "the best hybrid",
            .layout = "1,3",
            .settings =
                "set logscale y\nset offsets graph 0.06, graph 0.14, 0, 0\nset xtics autofreq\n"
                "set ytics (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10)\nset ylabel 'RMSE, mm'\n"
                "unset key\n"};
  if (low < high) plot.settings += fmt::format("set yrange [{}:{}]\n", low / 1.3, high * 1.3);
  for (const Panel& panel : panels)
    plot.panels.push_back({fmt::format("set xlabel '{}'\n", panel.label),
                           panel_data(study, panel),
                           {{"index 1 using 1:2 with fsteps lw 1 dt (4,3) lc rgb '#7f7f7f'"},
                            {"index 0 using 1:2:3:4 with yerrorbars pt 7 ps 0.8 lc rgb '#1f77b4'"},
                            {"index 2 every ::0::0 using 1:2 with points pt 6 ps 1.9 lw 2 lc rgb '#d62728'"},
                            {"index 2 every ::1::1 using 1:2 with points pt 8 ps 2.2 lw 2 lc rgb '#2ca02c'"},
                            {"index 0 every 2::0 using 1:2:5 with labels left offset 0.8,0.5"},
                            {"index 0 every 2::1 using 1:2:5 with labels left offset 0.8,-0.5"}}});
  return plot;
}

}  // namespace

std::vector<RatioCriteria> criteria_of(const RatioStudy& study, const RatioAssumptions& assumptions) {
  std::vector<RatioCriteria> criteria;
  for (const RatioResult& r : study.ratios) {
    const RatioDesign again = design_ratio(r.design.share, study.task, assumptions);
    criteria.push_back(criteria_of(again, r.measured, study.task, assumptions));
  }
  return criteria;
}

std::vector<RatioVerdict> verdicts_of(const RatioStudy& study) {
  std::vector<RatioVerdict> verdicts;
  const std::vector<RatioMeasured> measured = measured_of(study);
  const auto judge = [&](const std::string& change, const RatioAssumptions& assumptions) {
    const std::vector<RatioCriteria> criteria = criteria_of(study, assumptions);
    const int best = recommended(criteria, measured);
    if (best < 0) return;
    const auto b = static_cast<std::size_t>(best);
    double second = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < criteria.size(); ++i)
      if (i != b && measured[i].bad == 0) second = std::min(second, criteria[i].score);
    verdicts.push_back(
        {change, study.ratios[b].design.share, second - criteria[b].score, best_hybrid(study, criteria)});
  };
  judge("", study.assumptions);
  for (const RatioChange& change : study.assumptions.changes) judge(change.name, study.assumptions.with(change));
  return verdicts;
}

Result result_of(const RatioStudy& study) {
  return {.facts = {{"folder", study.folder}},
          .tables = {designs(study), measures(study), verdicts_table(study)},
          .notes = {"Results: " + study.folder},
          .plot = plot_of(study)};
}

}  // namespace solenoid
