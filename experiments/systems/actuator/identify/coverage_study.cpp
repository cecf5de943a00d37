#include "experiments/systems/actuator/identify/coverage_study.hpp"

#include "core/signal/bessel.hpp"
#include "experiments/base/gnuplot.hpp"
#include "experiments/base/processes.hpp"
#include "experiments/base/result.hpp"
#include "experiments/systems/actuator/identify/chambers.hpp"
#include "experiments/systems/actuator/identify/identify.hpp"
#include "experiments/systems/actuator/identify/noise.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Column = Table::Column;

constexpr double near_share = 0.05, near_s = 0.2e-3;

/// One seed's estimates: name, unit, value, low, high.
std::string identify_seed(const CoverageSettings& settings, std::uint64_t seed) {
  ExperimentSettings run = settings.run;
  run.seed = seed;
  std::vector<Record> records;
  for (const Experiment& e : settings.experiments) records.push_back(simulate_experiment(e, settings.twin, run));
  const Findings found = identify(records, ActuatorParameters{});
  nlohmann::json list = nlohmann::json::array();
  for (const Estimate& e : found.estimates) list.push_back({e.name, e.unit, e.value, e.low, e.high});
  return list.dump();
}

class Tally {
 public:
  explicit Tally(const std::map<std::string, double>& truths) : truths_(truths) {}

  void add(const nlohmann::json& estimates) {
    for (const auto& e : estimates) {
      const auto truth = truths_.find(e.at(0).get<std::string>());
      if (truth == truths_.end()) continue;
      CoverageRow& row = row_of(truth->first, e.at(1).get<std::string>(), truth->second);
      const double value = e.at(2), low = e.at(3), high = e.at(4), error = std::abs(value - row.truth);
      ++row.runs;
      row.mean += value;
      row.deviation += error * error;
      row.half_width += (high - low) / 2;
      row.covered += low <= row.truth && row.truth <= high;
      row.near += error <= (row.name.ends_with("delay_s") ? near_s : near_share * std::abs(row.truth));
    }
  }
  std::vector<CoverageRow> rows() && {
    for (CoverageRow& row : rows_) {
      row.mean /= row.runs;
      row.half_width /= row.runs;
      row.deviation = std::sqrt(row.deviation / row.runs);
    }
    return std::move(rows_);
  }

 private:
  CoverageRow& row_of(const std::string& name, const std::string& unit, double truth) {
    const auto at = std::ranges::find(rows_, name, &CoverageRow::name);
    if (at != rows_.end()) return *at;
    CoverageRow row;
    row.name = name;
    row.unit = unit;
    row.truth = truth;
    rows_.push_back(row);
    return rows_.back();
  }

  const std::map<std::string, double>& truths_;
  std::vector<CoverageRow> rows_;
};

}  // namespace

TwinParameters coverage_twin() {
  TwinParameters twin;
  ActuatorParameters& a = twin.actuator;
  const ContinuousFlow flow = continuous_flow(a.fill_coefficient, a.supply_pressure_pa, a);
  a.choked_flow = flow.choked_flow;
  a.discharge_coefficient = flow.discharge_coefficient;
  twin.sensing = nominal_twin().sensing;
  twin.valves.jitter_sigma_s = nominal_twin().valves.jitter_sigma_s;
  return twin;
}

std::map<std::string, double> true_values(const TwinParameters& twin, double payload_kg) {
  const ActuatorParameters& a = twin.actuator;
  std::map<std::string, double> truths = {{"static_friction_n", a.static_friction_n},
                                          {"coulomb_friction_n", a.coulomb_friction_n},
                                          {"viscous_friction", a.viscous_friction},
                                          {"fill_coefficient", a.fill_coefficient},
                                          {"discharge_coefficient", a.discharge_coefficient},
                                          {"choked_flow", a.choked_flow},
                                          {"supply_pressure_pa", a.supply_pressure_pa},
                                          {"energise_delay_s", a.energise_delay_s},
                                          {"deenergise_delay_s", a.deenergise_delay_s},
                                          {"inferred_equivalent_mass_kg", a.equivalent_mass_kg()},
                                          {"block_mass_kg", a.block_mass_kg},
                                          {"inferred_arm_torque_nm", a.gravity_torque_nm()},
                                          {"payload_mass_kg", payload_kg}};
  truths["position_noise_m"] = twin.sensing.position_sigma_m;
  truths["pressure_a_noise_pa"] = truths["pressure_b_noise_pa"] = filtered_pressure_sigma_pa(twin.sensing);
  if (twin.sensing.bessel_hz > 0)
    truths["pressure_filter_delay_s"] =
        Bessel8::delay_times_cutoff_rad / (2 * std::numbers::pi * twin.sensing.bessel_hz);
  return truths;
}

bool CoverageStudy::good() const {
  return failed == 0 && !rows.empty() && std::ranges::all_of(rows, &CoverageRow::good);
}

CoverageStudy study_coverage(const CoverageSettings& settings, const std::function<void(int done)>& progress,
                             const std::function<bool()>& interrupted) {
  const auto truths = true_values(settings.twin, settings.run.loaded_payload_kg);
  std::vector<std::size_t> items(static_cast<std::size_t>(settings.seeds));
  std::iota(items.begin(), items.end(), std::size_t{0});
  std::vector<nlohmann::json> results(items.size());  // by seed: the order of ending must not show
  CoverageStudy study;
  PoolEvents events;
  events.interrupted = interrupted;
  events.ended = [&](std::size_t item, const Outcome& outcome) {
    if (outcome.done)
      results[item] = nlohmann::json::parse(outcome.text);
    else
      ++study.failed;
    progress(++study.seeds);
  };
  study.interrupted = !work_in_processes(
      items, settings.jobs, [&](std::size_t item) { return identify_seed(settings, settings.first_seed + item); },
      events);
  Tally tally(truths);
  for (const nlohmann::json& one : results)
    if (!one.is_null()) tally.add(one);
  study.rows = std::move(tally).rows();
  return study;
}

Result result_of(const CoverageStudy& study) {
  Table table{
      .name = "values",
      .columns = {Column("name", "value", "<"), Column("unit"), Column("truth", "truth", ".5g"),
                  Column("mean", "mean", ".5g"), Column("rms_error"), Column("half_width"),
                  Column("", "error %", ".2f%"), Column("", "interval +- %", ".2f%"), Column("runs"), Column("covered"),
                  Column("near"), Column("", "truth inside"), Column("", "near"), Column("", "unit", "<")}};
  Plot plot{.width = 1000, .height = 520, .layout = "1,2"};
  std::string data, tics;
  for (const CoverageRow& r : study.rows) {
    const double error = r.deviation / std::abs(r.truth), width = r.half_width / std::abs(r.truth);
    tics += fmt::format("{}{} {}", table.rows.empty() ? "" : ", ", gnuplot_quoted(r.name), table.rows.size());
    data += fmt::format("{} {} {} {} {}\n", table.rows.size(), 100 * (r.mean / r.truth - 1), 100 * error, 100 * width,
                        100.0 * r.covered / r.runs);
    table.add({r.name, r.unit, r.truth, r.mean, r.deviation, r.half_width, error, width, r.runs, r.covered, r.near,
               fmt::format("{} of {}", r.covered, r.runs), fmt::format("{} of {}", r.near, r.runs), r.unit});
  }
  const auto bad = std::ranges::count_if(study.rows, [](const CoverageRow& r) { return !r.good(); });
  table.notes = {fmt::format(
      "\n{} seeds. Inside: the truth in the 95 % interval; near: within 5 %, delays within 0.2 ms. {}", study.seeds,
      bad == 0 ? "Both in at least 9 of 10 for every value." : fmt::format("{} values miss 9 of 10.", bad))};
  plot.settings = fmt::format("set yrange [{}:-0.7]\nset ytics ({})\nset lmargin at screen 0.24\n",
                              static_cast<double>(table.rows.size()) - 0.3, tics);
  plot.panels = {{"set rmargin at screen 0.68\nset xlabel 'value less truth [%]'\n"
                  "set key outside top center horizontal\n",
                  data,
                  {{"using 2:1:4 with xerrorbars pt 0 lw 6 lc rgb '#c6dbef'", "95 % interval, mean"},
                   {"using 2:1:3 with xerrorbars pt 7 ps 0.4 lw 1.5 lc rgb '#1f77b4'", "error over the seeds, RMS"}}},
                 {"unset key\nset format y ''\nset lmargin at screen 0.71\nset rmargin at screen 0.97\n"
                  "set xrange [80:100]\nset xlabel 'intervals that hold the truth [%]'\n"
                  "set arrow from 95,graph 0 to 95,graph 1 nohead dt 2 lc rgb '#606060'\n",
                  data,
                  {{"using 5:1 with points pt 7 ps 0.6 lc rgb '#d62728'"}}}};
  return {.facts = {{"seeds", study.seeds}, {"failed", study.failed}}, .tables = {table}, .plot = plot};
}

}  // namespace solenoid
