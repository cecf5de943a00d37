#include "experiments/systems/actuator/identify/residual_study.hpp"

#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/processes.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/systems/actuator/identify/residual.hpp"
#include "experiments/systems/actuator/identify/residual_prediction.hpp"

#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Column = Table::Column;

constexpr std::uint64_t judged_seed = 1, learned_seed = 2;

struct StudiedPlant {
  ScenarioConfig scenario;
  bool training = false;
};

/// The first plants of the two motions of a campaign.
void add_plants(const std::string& campaign, const std::vector<std::string>& tasks, bool training, int plants,
                std::vector<StudiedPlant>& all) {
  const Campaign read = read_campaign(campaign, {.variants = {"nine_robust"}, .scenarios = tasks});
  std::vector<int> taken(tasks.size(), 0);
  for (std::size_t i = 0; i < read.scenarios.size(); ++i)
    for (std::size_t t = 0; t < tasks.size(); ++t)
      if (read.scenarios.name(i).starts_with(tasks[t] + "-") && taken[t]++ < plants)
        all.push_back({read.scenarios.at(i), training});
}

/// A run as its log would have it.
Record record_of(const RunResult& run, const VariantConfig& v) {
  Record r;
  r.name = "run";
  r.plane = actuator(v).nominal.plane;
  r.valves = v.modes;
  r.period_s = v.timing.tick_s;
  for (const TickRecord& tick : run.ticks) {
    r.position_m.push_back(tick.sensors.value[position_channel]);
    r.pressure_a_pa.push_back(tick.sensors.value[pressure_a_channel]);
    r.pressure_b_pa.push_back(tick.sensors.value[pressure_b_channel]);
    r.motor_n.push_back(tick.applied.continuous[0]);
    r.coils.push_back(tick.applied.switches);
  }
  return r;
}

/// The plant in a motion to learn from: to and fro, from fast to slow, with other noise than it is judged with.
ScenarioConfig to_and_fro(ScenarioConfig scenario) {
  constexpr double far_m = 0.1, rest_s = 0.5;
  const double near_m = scenario.trajectory.start()[0];
  Trajectory motion(near_m);
  motion.dwell(rest_s);
  for (const double move_s : {0.65, 0.9, 1.3, 2.0, 3.0}) motion.cycloid_to(far_m, move_s).cycloid_to(near_m, move_s);
  scenario.duration_s = motion.duration_s() + rest_s;
  scenario.trajectory = motion;
  return scenario;
}

Json work(const StudiedPlant& plant) {
  const VariantConfig robust = told(shipped_variant("nine_robust"), plant.scenario),
                      shipped = told(shipped_variant("nine_residual"), plant.scenario);
  VariantConfig own = robust;
  Json j;
  j["learned"] = true;
  try {
    const std::vector<Record> learned = {record_of(simulate(robust, to_and_fro(plant.scenario), learned_seed), robust)};
    const ResidualFinding found = identify_residual(
        {residual_samples(learned[0], actuator(robust).nominal, actuator(robust).estimation.pressure_filter_hz)});
    if (!prediction_error(learned, robust, found.residual()).better()) throw ConfigError("predicts no better");
    actuator(own).residual = found.residual();
    if (const std::optional<HeldOutForce>& held = found.held_out) j["held_out"] = {held->without_n, held->with_n};
  } catch (const ConfigError&) {
    j["learned"] = false;
  }
  const RunResult judged = simulate(robust, plant.scenario, judged_seed),
                  by_shipped = simulate(shipped, plant.scenario, judged_seed),
                  by_own = simulate(own, plant.scenario, judged_seed);
  j["rmse"] = {judged.metrics.number("rmse_mm"), by_shipped.metrics.number("rmse_mm"),
               by_own.metrics.number("rmse_mm")};
  j["switches"] = {judged.metrics.number("coil_switches"), by_own.metrics.number("coil_switches")};
  const std::vector<Record> record = {record_of(judged, robust)};
  const PredictionError with_own = prediction_error(record, robust, actuator(own).residual),
                        with_shipped = prediction_error(record, robust, actuator(shipped).residual);
  j["ahead"] = {1e3 * with_own.without_m, 1e3 * with_own.with_m, 1e3 * with_shipped.with_m};
  j["outside"] = {with_own.outside, with_shipped.outside};
  return j;
}

void take(const Json& j, ResidualPlant& plant) {
  plant.learned = j.at("learned").get<bool>();
  plant.robust_mm = j.at("rmse")[0], plant.shipped_mm = j.at("rmse")[1], plant.own_mm = j.at("rmse")[2];
  plant.switches_robust = j.at("switches")[0], plant.switches_own = j.at("switches")[1];
  if (j.contains("held_out"))
    plant.held_out_without_n = j.at("held_out")[0].get<double>(),
    plant.held_out_with_n = j.at("held_out")[1].get<double>();
  plant.ahead_without_mm = j.at("ahead")[0], plant.ahead_with_mm = j.at("ahead")[1],
  plant.ahead_shipped_mm = j.at("ahead")[2];
  plant.outside = j.at("outside")[0], plant.outside_shipped = j.at("outside")[1];
}

/// Geometric means over plants of a kind, and on how many of them each beats nine_robust.
std::string summary(const ResidualStudy& study, const std::string& kind,
                    const std::function<bool(const ResidualPlant&)>& counts) {
  double robust = 0.0, shipped = 0.0, own = 0.0;
  int n = 0, shipped_better = 0, own_better = 0;
  for (const ResidualPlant& p : study.plants) {
    if (!counts(p)) continue;
    robust += std::log(p.robust_mm), shipped += std::log(p.shipped_mm), own += std::log(p.own_mm);
    shipped_better += p.shipped_mm < p.robust_mm, own_better += p.own_mm < p.robust_mm;
    ++n;
  }
  if (n == 0) return {};
  const double mean = std::exp(robust / n);
  return fmt::format(
      "{} {}, geometric mean of the RMSE: nine_robust {:.4f} mm, nine_residual {:.4f} mm ({:+.1f} %, better on "
      "{}), the plant's own residual {:.4f} mm ({:+.1f} %, better on {})",
      n, kind, mean, std::exp(shipped / n), 100 * (std::exp((shipped - robust) / n) - 1), shipped_better,
      std::exp(own / n), 100 * (std::exp((own - robust) / n) - 1), own_better);
}

}  // namespace

ResidualStudy study_residual(const ResidualStudySettings& settings,
                             const std::function<void(const std::string&)>& progress,
                             const std::function<bool()>& interrupted) {
  std::vector<StudiedPlant> plants;
  add_plants("baselines_training", {"cycloidal_training", "sine_training"}, true, settings.plants, plants);
  add_plants("robustness", {"cycloidal", "sine"}, false, settings.plants, plants);
  ResidualStudy study;
  std::vector<std::size_t> numbers(plants.size());
  std::iota(numbers.begin(), numbers.end(), std::size_t{0});
  for (const StudiedPlant& plant : plants)
    study.plants.push_back({.name = plant.scenario.name, .training = plant.training});
  PoolEvents events;
  events.interrupted = interrupted;
  std::vector<bool> finished(plants.size(), false);
  std::size_t done = 0;
  events.ended = [&](std::size_t i, const Outcome& outcome) {
    progress(fmt::format("{} of {} plants", ++done, plants.size()));
    finished[i] = outcome.done;
    if (outcome.done)
      take(Json::parse(outcome.text), study.plants[i]);
    else
      ++study.failed;
  };
  study.interrupted = !work_in_processes(
      numbers, settings.jobs, [&](std::size_t i) { return work(plants[i]).dump(); }, events);
  std::vector<ResidualPlant> whole;
  for (std::size_t i = 0; i < plants.size(); ++i)
    if (finished[i]) whole.push_back(study.plants[i]);
  study.plants = whole;
  return study;
}

Result result_of(const ResidualStudy& study) {
  Table table{
      .name = "plants",
      .columns = {Column("plant", "plant", "<"), Column("training"), Column("robust_mm", "RMSE mm nine_robust", ".4f"),
                  Column("shipped_mm", "nine_residual", ".4f"), Column("own_mm", "own residual", ".4f"),
                  Column("switches_robust", "switches", ".0f"), Column("switches_own", "own", ".0f"),
                  Column("held_out_without_n", "force left N", ".2f"), Column("held_out_with_n", "with own", ".2f"),
                  Column("ahead_without_mm", "40 ms ahead mm", ".4f"), Column("ahead_shipped_mm", "shipped", ".4f"),
                  Column("ahead_with_mm", "own", ".4f"), Column("outside_shipped", "outside % shipped", ".1f%"),
                  Column("outside", "own", ".1f%"), Column("learned")}};
  for (const ResidualPlant& p : study.plants)
    table.add({p.name, p.training, p.robust_mm, p.shipped_mm, p.own_mm, p.switches_robust, p.switches_own,
               p.held_out_without_n, p.held_out_with_n, p.ahead_without_mm, p.ahead_shipped_mm, p.ahead_with_mm,
               p.outside_shipped, p.outside, p.learned});
  const auto note = [&](const std::string& kind, const std::function<bool(const ResidualPlant&)>& counts) {
    if (std::string text = summary(study, kind, counts); !text.empty()) table.notes.push_back(std::move(text));
  };
  note("training plants", [](const ResidualPlant& p) { return p.training; });
  note("other plants", [](const ResidualPlant& p) { return !p.training; });
  note("plants on which there was something to learn", [](const ResidualPlant& p) { return p.learned; });
  return {.facts = {{"failed", study.failed}}, .tables = {table}};
}

}  // namespace solenoid
