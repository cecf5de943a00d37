#include "experiments/base/gnuplot.hpp"
#include "experiments/base/text_table.hpp"
#include "experiments/study/force_ratio.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Align = TextTable::Align;

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

std::string designs_text(const RatioStudy& study) {
  TextTable table({{"motor's share"},
                   {"ratio"},
                   {"bore mm"},
                   {"cylinder N"},
                   {"motor N"},
                   {"motor N m"},
                   {"pinion mm"},
                   {"tooth safety"},
                   {"mass kg"},
                   {"price"}});
  for (const RatioResult& r : study.ratios) {
    const RatioDesign& d = r.design;
    const auto of_motor = [&](double value) { return d.has_motor() ? fmt::format("{:.3g}", value) : "-"; };
    table.add_row(std::vector<std::string>{
        share_text(d.share), ratio_text(d), d.has_cylinder() ? fmt::format("{:.2f}", 1e3 * d.bore_m) : "-",
        fmt::format("{:.1f}", d.cylinder_n), fmt::format("{:.1f}", d.motor_n), of_motor(d.motor_torque_nm),
        of_motor(1e3 * d.pinion_m), of_motor(d.pinion_safety), fmt::format("{:.2f}", d.mass_kg),
        fmt::format("{:.0f}", d.price)});
  }
  return table.text(false);
}

std::string measured_text(const RatioStudy& study, bool colour) {
  const std::vector<RatioCriteria> criteria = criteria_of(study, study.assumptions);
  const std::vector<bool> front = efficient(criteria);
  const int best = recommended(criteria, measured_of(study));
  TextTable table({{"motor's share"},
                   {"law", Align::left},
                   {"RMSE mm"},
                   {"95 %"},
                   {"worst mm"},
                   {"switches/s"},
                   {"air g"},
                   {"electric J"},
                   {"air J"},
                   {"energy J"},
                   {"front", Align::left},
                   {"score"},
                   {"bad"}});
  for (std::size_t i = 0; i < study.ratios.size(); ++i) {
    const RatioMeasured& m = study.ratios[i].measured;
    const RatioCriteria& c = criteria[i];
    table.add_row(std::vector<TextTable::Cell>{{share_text(study.ratios[i].design.share)},
                                               {study.ratios[i].law},
                                               {fmt::format("{:.4f}", m.rmse_mm)},
                                               {fmt::format("{:.0f} %", 100 * (m.rmse_margin - 1))},
                                               {fmt::format("{:.3f}", m.worst_rmse_mm)},
                                               {fmt::format("{:.1f}", m.switches_per_s)},
                                               {fmt::format("{:.3f}", m.air_g)},
                                               {fmt::format("{:.2f}", c.electric_j)},
                                               {fmt::format("{:.2f}", c.air_j)},
                                               {fmt::format("{:.2f}", c.energy_j())},
                                               {front[i] ? "yes" : ""},
                                               {fmt::format("{:.2f}", c.score), static_cast<int>(i) == best},
                                               {fmt::format("{} of {}", m.bad, m.runs)}});
  }
  return table.text(colour);
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

std::string verdict_text(const RatioStudy& study) {
  const std::vector<RatioVerdict> verdicts = verdicts_of(study);
  if (verdicts.empty()) return "No ratio stands: in each a run ended badly.\n";
  const auto hybrid = [](const RatioVerdict& v) { return v.hybrid_share ? share_text(*v.hybrid_share) : "-"; };
  std::string text = fmt::format("Recommended: a motor's share of {}, its score {:.2f} ahead of the next.\n",
                                 share_text(verdicts.front().share), verdicts.front().lead);
  if (verdicts.front().hybrid_share)
    text += fmt::format("Among those with cylinder and motor: {}.\n", hybrid(verdicts.front()));
  if (const std::string close = not_told_apart(study); !close.empty())
    text += "Not told apart from the recommended by the errors' 95 % intervals: " + close + ".\n";
  text += "\n";
  TextTable table({{"assumption changed", Align::left}, {"recommended share"}, {"lead"}, {"best hybrid"}});
  int same = 0, same_hybrid = 0;
  for (std::size_t i = 1; i < verdicts.size(); ++i) {
    same += verdicts[i].share == verdicts.front().share;
    same_hybrid += verdicts[i].hybrid_share == verdicts.front().hybrid_share;
    table.add_row(std::vector<std::string>{verdicts[i].change, share_text(verdicts[i].share),
                                           fmt::format("{:.2f}", verdicts[i].lead), hybrid(verdicts[i])});
  }
  return text + table.text(false) +
         fmt::format("\nThe recommendation stays in {0} of {2} changes, the best hybrid in {1} of {2}.\n", same,
                     same_hybrid, verdicts.size() - 1);
}

struct Panel {
  const char *file, *label;
  double (*cost)(const RatioCriteria&);
};
constexpr Panel panels[] = {{"price", "price of the drive", [](const RatioCriteria& c) { return c.price; }},
                            {"mass", "mass of the drive, kg", [](const RatioCriteria& c) { return c.mass_kg; }},
                            {"energy", "energy of a run, J", [](const RatioCriteria& c) { return c.energy_j(); }}};

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

std::string force_ratio_text(const RatioStudy& study, bool colour) {
  if (study.ratios.empty()) return "No ratio is done.\n";
  return "Cylinder and motor at equal capability, their largest forces' sum:\n\n" + designs_text(study) +
         "\nEach tuned and judged on plants it has not seen; means of a run, energies of its air and its motor:\n\n" +
         measured_text(study, colour) + "\n" + verdict_text(study) + "Results: " + study.folder + "\n";
}

std::string force_ratio_csv(const RatioStudy& study) {
  const std::vector<RatioCriteria> criteria = criteria_of(study, study.assumptions);
  const std::vector<bool> front = efficient(criteria);
  std::string text =
      "share,bore_mm,cylinder_n,motor_n,motor_torque_nm,pinion_mm,mass_kg,price,law,evaluations,rmse_mm,rmse_margin,"
      "worst_rmse_mm,switches_per_s,air_g,motor_rms_n,electric_j,air_j,energy_j,front,score,runs,bad\n";
  for (std::size_t i = 0; i < study.ratios.size(); ++i) {
    const RatioResult& r = study.ratios[i];
    const RatioMeasured& m = r.measured;
    const RatioCriteria& c = criteria[i];
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},", r.design.share, 1e3 * r.design.bore_m, r.design.cylinder_n,
                        r.design.motor_n, r.design.motor_torque_nm, 1e3 * r.design.pinion_m, r.design.mass_kg,
                        r.design.price, r.law, r.evaluations);
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", m.rmse_mm, m.rmse_margin, m.worst_rmse_mm,
                        m.switches_per_s, m.air_g, m.motor_rms_n, c.electric_j, c.air_j, c.energy_j(), front[i] ? 1 : 0,
                        c.score, m.runs, m.bad);
  }
  return text;
}

std::string force_ratio_json(const RatioStudy& study) {
  const std::vector<RatioCriteria> criteria = criteria_of(study, study.assumptions);
  const std::vector<bool> front = efficient(criteria);
  nlohmann::ordered_json json = {{"ratios", nlohmann::ordered_json::array()}};
  for (std::size_t i = 0; i < study.ratios.size(); ++i) {
    const RatioResult& r = study.ratios[i];
    const RatioMeasured& m = r.measured;
    const RatioCriteria& c = criteria[i];
    nlohmann::ordered_json tuned = nlohmann::ordered_json::object();
    for (const auto& [key, value] : r.tuned) tuned[key] = value;
    json["ratios"].push_back({{"share", r.design.share},
                              {"bore_mm", 1e3 * r.design.bore_m},
                              {"cylinder_n", r.design.cylinder_n},
                              {"motor_n", r.design.motor_n},
                              {"motor_torque_nm", r.design.motor_torque_nm},
                              {"pinion_mm", 1e3 * r.design.pinion_m},
                              {"mass_kg", r.design.mass_kg},
                              {"price", r.design.price},
                              {"law", r.law},
                              {"tuned", tuned},
                              {"evaluations", r.evaluations},
                              {"rmse_mm", m.rmse_mm},
                              {"rmse_margin", m.rmse_margin},
                              {"worst_rmse_mm", m.worst_rmse_mm},
                              {"switches_per_s", m.switches_per_s},
                              {"air_g", m.air_g},
                              {"motor_rms_n", m.motor_rms_n},
                              {"electric_j", c.electric_j},
                              {"air_j", c.air_j},
                              {"energy_j", c.energy_j()},
                              {"front", static_cast<bool>(front[i])},
                              {"score", c.score},
                              {"runs", m.runs},
                              {"bad", m.bad}});
  }
  json["verdicts"] = nlohmann::ordered_json::array();
  for (const RatioVerdict& v : verdicts_of(study))
    json["verdicts"].push_back({{"change", v.change},
                                {"share", v.share},
                                {"lead", v.lead},
                                {"hybrid_share", v.hybrid_share ? nlohmann::ordered_json(*v.hybrid_share) : nullptr}});
  json["folder"] = study.folder;
  return json.dump(1) + "\n";
}

void draw_force_ratio(const RatioStudy& study, const std::string& path) {
  std::map<std::string, std::string> files;
  std::string script = R"(set terminal svg size 1280,440 font 'Helvetica,13' background '#ffffff' noenhanced
set output 'figure'
set encoding utf8
set multiplot layout 1,3 title "error against price, mass and energy; labels: the motor's share; circle: recommended, triangle: the best hybrid"
set logscale y
set grid back lt 1 lw 0.7 lc rgb '#dddddd'
set border 3 lc rgb '#606060'
set tics nomirror out scale 0.5
set offsets graph 0.06, graph 0.14, 0, 0
set xtics autofreq
set ytics (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10)
set ylabel 'RMSE, mm'
unset key
)";
  double low = std::numeric_limits<double>::infinity(), high = 0.0;
  for (const RatioResult& r : study.ratios) {
    low = std::min(low, r.measured.rmse_mm / r.measured.rmse_margin);
    high = std::max(high, r.measured.rmse_mm * r.measured.rmse_margin);
  }
  if (low < high) script += fmt::format("set yrange [{}:{}]\n", low / 1.3, high * 1.3);
  for (const Panel& panel : panels) {
    files[panel.file] = panel_data(study, panel);
    script += fmt::format(
        "set xlabel '{0}'\n"
        "plot '{1}' index 1 using 1:2 with fsteps lw 1 dt (4,3) lc rgb '#7f7f7f', "
        "'{1}' index 0 using 1:2:3:4 with yerrorbars pt 7 ps 0.8 lc rgb '#1f77b4', "
        "'{1}' index 2 every ::0::0 using 1:2 with points pt 6 ps 1.9 lw 2 lc rgb '#d62728', "
        "'{1}' index 2 every ::1::1 using 1:2 with points pt 8 ps 2.2 lw 2 lc rgb '#2ca02c', "
        "'{1}' index 0 every 2::0 using 1:2:5 with labels left offset 0.8,0.5, "
        "'{1}' index 0 every 2::1 using 1:2:5 with labels left offset 0.8,-0.5\n",
        panel.label, panel.file);
  }
  draw_with_gnuplot(files, script + "unset multiplot\nset output\n", path);
}

}  // namespace solenoid
