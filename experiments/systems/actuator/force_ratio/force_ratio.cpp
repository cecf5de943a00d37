#include "experiments/systems/actuator/force_ratio/force_ratio.hpp"

#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/base/processes.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/report/ranking.hpp"
#include "experiments/systems/actuator/force_ratio/force_ratio_plants.hpp"
#include "experiments/systems/actuator/sizing/size_task.hpp"
#include "experiments/tune/tune.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

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
    const double force = tick.applied.continuous[0];
    square += force * force * actuator_timing.tick_s;
    motoring += std::max(0.0, force * tick.sensors.truth[velocity]) * actuator_timing.tick_s;
  }
  return {{"ok", true},
          {"rmse_mm", m["rmse_mm"]},
          {"switches_per_s", m["switches_per_s"]},
          {"air_g", m["air_g"]},
          {"motor_rms_n", m["motor_rms_n"]},
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
  const std::string identity = identity_of(campaign);
  std::map<std::string, Json> runs;
  if (const auto text = read_whole_file(path, file_size::json)) {
    const Json kept = parse_json(*text, path, "a file of an earlier run, or none");
    if (kept.is_object() && kept.contains("runs") && kept.at("runs").is_object() &&
        kept.value("identity", Json()) == identity)
      runs = kept.at("runs").get<decltype(runs)>();
  }
  std::vector<std::size_t> todo;
  for (std::size_t i = 0; i < campaign.runs.size(); ++i)
    if (!runs.contains(campaign.runs[i].id)) todo.push_back(i);
  PoolEvents events;
  events.ended = [&](std::size_t i, const Outcome& outcome) {
    runs[campaign.runs[i].id] = outcome.done ? Json::parse(outcome.text) : Json{{"ok", false}, {"why", outcome.text}};
    write_file_atomically(path, Json{{"identity", identity}, {"runs", runs}}.dump(1) + "\n");
  };
  events.interrupted = [] { return InterruptGuard::raised(); };
  const auto work = [&](std::size_t i) {
    const CampaignRun& run = campaign.runs[i];
    return judge_run(campaign.variants[run.variant], campaign.scenarios[run.scenario], run.seed).dump();
  };
  if (!work_in_processes(todo, jobs > 0 ? jobs : this_machine().cores, work, events)) return std::nullopt;
  return measured_from(runs);
}

class RatioSweep {
 public:
  RatioSweep(const RatioSettings& settings, const std::function<void(const std::string&)>& progress)
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
    TuneSettings t;
    t.document = std::make_shared<const Document>(
        ratio_campaign(tuned.folder, "plants", law, controller_of(law, design), twin_of(design),
                       {{"training", "held_out"}, settings_.plants, settings_.quick}));
    t.campaign = t.document->name();
    t.variant = law;
    t.free = tuned.free;
    t.algorithm = "nelder_mead";  // so few evaluations must try every key
    t.evaluations = t.patience = settings_.evaluations;
    t.limits = {{"switches_per_s", study_.assumptions.limit_switches_per_s}, {"air_g", study_.assumptions.limit_air_g}};
    t.jobs = settings_.jobs;
    t.out = tuned.folder;
    tuned.result = tune(t, [&](const TuneResult& so_far) {
      progress_(fmt::format("share {:.3g}, {}: {} of {} evaluations, RMSE {:.3g} mm", design.share, law,
                            so_far.steps.size() - 1, settings_.evaluations, so_far.steps.back().training.error));
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
    const std::string name = best->law + "_tuned";
    const Document& tuned = *best->result.tuned;
    const Document controller = tuned.part("variant." + name, *tuned.root()["variant"][name].as_table());
    const Document judging = ratio_campaign(best->folder, "judging", name, controller, twin_of(design),
                                            {{"judging"}, settings_.judged, settings_.quick});
    const auto measured = judge(read_campaign(judging), best->folder + "/judged.json", settings_.jobs);
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
  return RatioSweep(settings, progress).run();
}

}  // namespace solenoid
