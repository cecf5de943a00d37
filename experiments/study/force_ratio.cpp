#include "experiments/study/force_ratio.hpp"

#include "controllers/timing.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/embedded.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/base/processes.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/library.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/report/ranking.hpp"
#include "experiments/sizing/size_task.hpp"
#include "experiments/tune/tune.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <toml++/toml.h>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

/// What is left of the cylinder in the model of a motor alone, whose valves stay closed: of the thesis's piston area.
constexpr double vestige = 2e-3;

std::string embedded(const char* name) { return std::string(embedded_text(name)); }

/// The actuator's keys that a ratio changes. Valves are as large as the piston, so that chambers fill as fast at every
/// ratio, and the rod keeps its part of the bore.
toml::table scaled_actuator(const RatioDesign& design) {
  toml::table actuator = *toml::parse(embedded("scenarios/twin.toml"))["actuator"].as_table();
  const ActuatorParameters rig;
  const double bore = design.has_cylinder() ? design.bore_m : std::sqrt(vestige) * rig.bore_diameter_m;
  const double scale = bore / rig.bore_diameter_m, area = scale * scale;
  const auto scaled = [&](const char* key, double rigs) {
    actuator.insert_or_assign(key, area * actuator[key].value_or(rigs));
  };
  actuator.insert_or_assign("bore_diameter_m", bore);
  actuator.insert_or_assign("rod_diameter_m", scale * rig.rod_diameter_m);
  scaled("fill_coefficient", rig.fill_coefficient);
  scaled("discharge_coefficient", rig.discharge_coefficient);
  scaled("choked_flow", rig.choked_flow);
  const double pinion = design.has_motor() ? design.pinion_m : rig.pinion_pitch_diameter_m;
  actuator.insert_or_assign("pinion_pitch_diameter_m", pinion);
  actuator.insert_or_assign("amplifier_gain",
                            design.motor_n * pinion / 2 / (rig.motor_torque_constant * rig.amplifier_limit_v));
  return actuator;
}

std::string twin_of(const RatioDesign& design) {
  toml::table twin = toml::parse(embedded("scenarios/twin.toml"));
  twin.insert_or_assign("actuator", scaled_actuator(design));
  if (design.has_motor())
    twin["gear"].as_table()->insert_or_assign("rotor_inertia", design.motor_inertia);
  else
    twin["gear"].as_table()->insert_or_assign("law", "rigid");
  return toml_text(twin) + "\n";
}

/// What the controller believes: the nominal twin's parameters, the rotor's inertia in the mass, as identifying gives.
toml::table believed_of(const RatioDesign& design) {
  toml::table model = scaled_actuator(design);
  const double radius = design.pinion_m / 2;
  const double rotor = design.has_motor() ? design.motor_inertia / (radius * radius) : 0.0;
  model.insert_or_assign("inferred_equivalent_mass_kg", model["inferred_equivalent_mass_kg"].value_or(0.0) + rotor);
  return model;
}

/// Half the way in a second or so.
toml::table quick_trajectory(const std::string& kind) {
  if (kind == "cycloidal") return toml::table{{"kind", kind}, {"to_m", 0.06}, {"move_s", 0.6}, {"dwell_s", 0.2}};
  return toml::table{{"kind", kind}, {"to_m", 0.06}, {"frequency_hz", 1.0}, {"periods", 1}, {"lead_s", 0.4}};
}

/// A campaign of the shipped plants whose names begin with one of `groups`.
std::string campaign_text(const RatioSettings& settings, const std::string& variant, const toml::table& controller,
                          const std::vector<std::string>& groups, int members) {
  const toml::table shipped = toml::parse(embedded("tasks/force_ratio_plants.toml"));
  toml::table campaign{{"variants", toml::array{variant}}, {"seeds", toml::array{1}}};
  campaign.insert("variant", toml::table{{variant, controller}});
  toml::array scenarios;
  for (const toml::node& node : *shipped["scenario"].as_array()) {
    toml::table scenario = *node.as_table();
    const std::string name = scenario["name"].value_or("");
    if (std::ranges::none_of(groups, [&](const std::string& group) { return name.starts_with(group); })) continue;
    scenario.insert_or_assign("twin", "twin.toml");
    scenario["ensemble"].as_table()->insert_or_assign("members", members);
    if (settings.quick)
      scenario.insert_or_assign("trajectory", quick_trajectory(scenario["trajectory"]["kind"].value_or("sine")));
    scenarios.push_back(scenario);
  }
  campaign.insert("scenario", scenarios);
  return toml_text(campaign) + "\n";
}

toml::table controller_of(const std::string& law, const RatioDesign& design) {
  toml::table controller = *toml::parse(embedded("tasks/force_ratio_plants.toml"))["variant"][law].as_table();
  controller.insert_or_assign("model", believed_of(design));
  return controller;
}

std::vector<std::string> laws_for(const RatioDesign& design) {
  if (!design.has_motor()) return {"cylinder"};
  if (!design.has_cylinder()) return {"motor"};
  return {"hybrid", "hybrid_inverse"};
}

std::vector<FreeParameter> free_of(const std::string& law) {
  std::vector<FreeParameter> free;
  const auto add = [&](const char* text) { free.push_back(parse_free_parameter(text)); };
  if (law != "motor") add("cost.switching=1e-11..1e-5:log");
  if (law == "cylinder") add("cost.terminal_position=1..100:log");
  if (law != "cylinder") add("motor_gains.proportional=2e4..4e6:log");
  if (law != "cylinder") add("motor_gains.derivative=500..10000:log");
  return free;
}

/// What a worker returns of one judging run.
Json judge_run(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed) {
  const RunResult run = simulate(variant, scenario, seed);
  const Metrics& m = run.metrics;
  if (!m.finite) return {{"ok", false}};
  double square = 0.0, motoring = 0.0;
  for (const TickRecord& tick : run.ticks) {
    const double force = tick.applied.motor_force_n;
    square += force * force * tick_s;
    motoring += std::max(0.0, force * tick.sensors.truth[velocity]) * tick_s;
  }
  return {{"ok", true},
          {"rmse_mm", m.rmse_mm},
          {"switches_per_s", m.switches_per_s},
          {"air_g", m.air_g},
          {"motor_rms_n", m.motor_rms_n},
          {"force_square_ns", square},
          {"motoring_j", motoring}};
}

RatioMeasured measured_from(const std::map<std::string, Json>& runs) {
  RatioMeasured r;
  std::vector<double> errors;
  for (const auto& [id, run] : runs) {
    ++r.runs;
    if (!run.at("ok").get<bool>()) {
      ++r.bad;
      continue;
    }
    errors.push_back(run.at("rmse_mm").get<double>());
    r.worst_rmse_mm = std::max(r.worst_rmse_mm, errors.back());
    r.switches_per_s += run.at("switches_per_s").get<double>();
    r.air_g += run.at("air_g").get<double>();
    r.motor_rms_n += run.at("motor_rms_n").get<double>();
    r.force_square_ns += run.at("force_square_ns").get<double>();
    r.motoring_j += run.at("motoring_j").get<double>();
  }
  if (errors.empty()) return r;
  const GeometricMean mean = geometric_mean(errors);
  r.rmse_mm = mean.value;
  r.rmse_margin = mean.margin;
  for (double* sum : {&r.switches_per_s, &r.air_g, &r.motor_rms_n, &r.force_square_ns, &r.motoring_j})
    *sum /= static_cast<double>(errors.size());
  return r;
}

/// The judging runs of a campaign, each kept on disk as it ends; nothing if interrupted.
std::optional<RatioMeasured> judge(const Campaign& campaign, const std::string& path, int jobs) {
  std::string identity;
  for (const CampaignRun& run : campaign.runs) identity += run.hash;
  identity = fingerprint(identity);
  std::map<std::string, Json> runs;
  if (const auto text = read_whole_file(path)) {
    const Json kept = Json::parse(*text, nullptr, false);
    if (kept.is_object() && kept.value("identity", "") == identity) runs = kept.at("runs").get<decltype(runs)>();
  }
  std::vector<std::size_t> todo;
  for (std::size_t i = 0; i < campaign.runs.size(); ++i)
    if (!runs.contains(campaign.runs[i].id)) todo.push_back(i);
  PoolEvents events;
  events.started = [](std::size_t) {};
  events.ended = [&](std::size_t i, const Outcome& outcome) {
    runs[campaign.runs[i].id] = outcome.done ? Json::parse(outcome.text) : Json{{"ok", false}, {"why", outcome.text}};
    write_file_atomically(path, Json{{"identity", identity}, {"runs", runs}}.dump(1) + "\n");
  };
  events.waiting = [] {};
  events.interrupted = [] { return InterruptGuard::raised(); };
  const auto work = [&](std::size_t i) {
    const CampaignRun& run = campaign.runs[i];
    return judge_run(campaign.variants[run.variant], campaign.scenarios[run.scenario], run.seed).dump();
  };
  if (!work_in_processes(todo, jobs > 0 ? jobs : this_machine().cores, work, events)) return std::nullopt;
  return measured_from(runs);
}

class Study {
 public:
  Study(const RatioSettings& settings, const std::function<void(const std::string&)>& progress)
      : settings_(settings), progress_(progress) {}

  RatioStudy run() {
    study_.task = thesis_sizing().task;
    study_.assumptions =
        settings_.assumptions.empty() ? shipped_ratio_assumptions() : read_ratio_assumptions(settings_.assumptions);
    study_.folder = settings_.out;
    std::vector<RatioDesign> designs;  // all of them first: what cannot be built is refused before anything runs
    for (const double share : sorted_shares()) designs.push_back(design_ratio(share, study_.task, study_.assumptions));
    for (const RatioDesign& design : designs) {
      const auto result = ratio(design);
      if (!result) {
        study_.interrupted = true;
        break;
      }
      study_.ratios.push_back(*result);
    }
    return std::move(study_);
  }

 private:
  struct Tuned {
    std::string law, folder;
    std::vector<FreeParameter> free;
    TuneResult result;
    double held_out() const { return result.steps[result.chosen].held_out->objective; }
  };

  std::vector<double> sorted_shares() const {
    std::vector<double> shares = settings_.shares;
    std::ranges::sort(shares);
    for (std::size_t i = 0; i < shares.size(); ++i)
      if (!(shares[i] >= 0 && shares[i] <= 1) || (i > 0 && shares[i] == shares[i - 1]))
        throw ConfigError(fmt::format("--shares: {} (allowed: numbers from 0 to 1, each once)", shares[i]));
    return shares;
  }

  std::optional<Tuned> tune_law(const std::string& law, const RatioDesign& design) {
    Tuned tuned{law, fmt::format("{}/share-{:.3f}/{}", settings_.out, design.share, law), free_of(law), {}};
    create_folder(tuned.folder);
    write_file_atomically(tuned.folder + "/twin.toml", twin_of(design));
    const std::string campaign = tuned.folder + "/plants.toml";
    write_file_atomically(campaign, campaign_text(settings_, law, controller_of(law, design), {"training", "held_out"},
                                                  settings_.plants));
    TuneSettings t;
    t.campaign = campaign;
    t.variant = law;
    t.free = tuned.free;
    t.algorithm = "nelder_mead";  // so few evaluations must try every key
    t.evaluations = t.patience = settings_.evaluations;
    t.switches_per_s = study_.assumptions.limit_switches_per_s;
    t.air_g = study_.assumptions.limit_air_g;
    t.jobs = settings_.jobs;
    t.out = tuned.folder;
    tuned.result = tune(t, [&](const TuneResult& so_far) {
      progress_(fmt::format("share {:.3g}, {}: {} of {} evaluations, RMSE {:.3g} mm", design.share, law,
                            so_far.steps.size() - 1, settings_.evaluations, so_far.steps.back().training.rmse_mm));
    });
    if (tuned.result.interrupted() || tuned.result.steps.empty()) return std::nullopt;
    return tuned;
  }

  /// The best law of a ratio, judged; nothing if interrupted.
  std::optional<RatioResult> ratio(const RatioDesign& design) {
    std::optional<Tuned> best;
    int evaluations = 0;
    for (const std::string& law : laws_for(design)) {
      auto tuned = tune_law(law, design);
      if (!tuned) return std::nullopt;
      evaluations += static_cast<int>(tuned->result.steps.size()) - 1;
      if (!best || tuned->held_out() < best->held_out()) best = std::move(tuned);
    }
    RatioResult result{design, best->law, {}, evaluations, {}};
    for (std::size_t i = 0; i < best->free.size(); ++i)
      result.tuned.emplace_back(best->free[i].key, best->result.steps[best->result.chosen].values[i]);
    const toml::table tuned = toml::parse_file(best->folder + "/tuned.toml");
    const std::string name = best->law + "_tuned", path = best->folder + "/judging.toml";
    write_file_atomically(
        path, campaign_text(settings_, name, *tuned["variant"][name].as_table(), {"judging"}, settings_.judged));
    const auto measured = judge(read_campaign(path), best->folder + "/judged.json", settings_.jobs);
    if (!measured) return std::nullopt;
    result.measured = *measured;
    progress_(fmt::format("share {:.3g}, {}: judged, RMSE {:.3g} mm", design.share, best->law, measured->rmse_mm));
    return result;
  }

  const RatioSettings& settings_;
  const std::function<void(const std::string&)>& progress_;
  RatioStudy study_;
};

}  // namespace

RatioStudy study_force_ratio(const RatioSettings& settings, const std::function<void(const std::string&)>& progress) {
  return Study(settings, progress).run();
}

}  // namespace solenoid
