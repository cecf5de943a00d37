#include "experiments/tune/tune.hpp"

#include "controllers/variant_keys.hpp"
#include "core/config/document.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/campaign/results_folder.hpp"
#include "experiments/campaign/run_campaign.hpp"
#include "experiments/campaign/variant_numbers.hpp"
#include "experiments/report/headings.hpp"
#include "experiments/report/ranking.hpp"
#include "experiments/tune/history.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <map>
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlopt.h>

namespace solenoid {
namespace {

constexpr double effort_weight = 5.0, bad_weight = 10.0;
constexpr double overshoot_range_percent = 35.0, sse_range_mm = 10.0;  // of Table 5-2
constexpr double least_error = 1e-6;                                   // of which a logarithm is taken
constexpr double first_step = 0.15;                                    // of each range
constexpr double converged = 0.01;                                     // of each range
constexpr std::string_view held_out_prefix = "held_out";

struct Algorithm {
  const char* name;
  nlopt_algorithm id;
};
constexpr std::array algorithms = {Algorithm{"subplex", NLOPT_LN_SBPLX}, Algorithm{"nelder_mead", NLOPT_LN_NELDERMEAD},
                                   Algorithm{"bobyqa", NLOPT_LN_BOBYQA}, Algorithm{"cobyla", NLOPT_LN_COBYLA},
                                   Algorithm{"direct", NLOPT_GN_DIRECT_L}};

/// What J adds for effort beyond the limits.
double effort_excess(const Score& s, const EffortLimits& limits) {
  double sum = 0.0;
  for (std::size_t i = 0; i < std::min(s.efforts.size(), limits.size()); ++i)
    if (s.efforts[i] > limits[i]) sum += std::log(s.efforts[i] / limits[i]);
  return effort_weight * sum;
}

/// Means over the runs that ended well.
void judge_steps(std::span<const RunRecord> records, Score& s) {
  for (const RunRecord& r : records) {
    if (!r.metrics || !has_step_metrics(description_of(r))) continue;
    s.overshoot_percent += r.metrics->number("overshoot_percent") / (s.runs - s.bad);
    s.sse_mm += r.metrics->number("sse_max_abs_mm") / (s.runs - s.bad);
  }
}

double error_of(const Score& s, TuneAim aim) {
  return aim == TuneAim::rmse ? s.error
                              : std::hypot(s.overshoot_percent / overshoot_range_percent, s.sse_mm / sse_range_mm);
}

/// Campaigns of one variant with values of ours: what the reader refuses it refuses here.
class Candidates {
 public:
  explicit Candidates(const TuneSettings& settings) : settings_(settings), base_(campaign_of(settings)) {
    for (const std::string& name : base_.scenarios.tasks())
      (name.starts_with(held_out_prefix) ? held_out_ : training_).push_back(name);
    if (training_.empty() || held_out_.empty())
      throw ConfigError(
          fmt::format("{}: {} scenarios to train on, {} held out (allowed: some of each; those whose names "
                      "begin with {} are held out)",
                      settings.campaign, training_.size(), held_out_.size(), held_out_prefix));
    check_settings();
    check_ends();
    identity_ = identity_of(base_);
  }

  /// Of the campaign before any value is set.
  const std::string& identity() const { return identity_; }
  const std::vector<InputFile>& inputs() const { return base_.inputs; }
  const SystemDescription& system() const { return base_.system->description(); }
  Campaign training(const std::vector<double>& values) const { return read(values, training_); }
  Campaign held_out(const std::vector<double>& values) const { return read(values, held_out_); }

  /// What the variant has now, as near as the ranges allow; the middle of the range where nobody knows.
  std::vector<double> start() const {
    std::vector<double> values;
    for (const FreeParameter& p : settings_.free) {
      auto said = number_at(variant(), p.key);
      if (!said) said = default_number(*base_.system, p.key);
      values.push_back(p.at(said ? p.point(*said) : 0.5));
    }
    return values;
  }

  /// The variant and NAME_tuned on the held-out scenarios.
  Document tuned_campaign(const std::vector<double>& values) const {
    Document document = *base_.resolved;
    toml::table& root = document.root();
    const std::string name = settings_.variant + "_tuned";
    root["variants"].as_array()->push_back(name);
    root["variant"].as_table()->insert(name, variant());
    set(document, name, values);
    toml::array scenarios;
    for (const toml::node& scenario : *base_.resolved->root()["scenario"].as_array())
      if (scenario.as_table()->get("name")->value<std::string>()->starts_with(held_out_prefix))
        scenarios.push_back(*scenario.as_table());
    root.insert_or_assign("scenario", std::move(scenarios));
    return document;
  }

 private:
  static Campaign campaign_of(const TuneSettings& settings) {
    const Selection selection{{settings.variant}, {}};
    return settings.document ? read_campaign(*settings.document, selection)
                             : read_campaign(settings.campaign, selection);
  }

  /// What the system's runs are judged by.
  void check_settings() const {
    std::vector<std::string> known;
    for (const MetricColumn& effort : effort_metrics(system())) known.push_back(effort.key);
    for (const auto& [key, limit] : settings_.limits)
      if (std::ranges::count(known, key) == 0)
        throw ConfigError(
            fmt::format("--limit: '{}' is no effort of {} (allowed: {})", key, system().name, fmt::join(known, ", ")));
    if (settings_.aim == TuneAim::step && !has_step_metrics(system()))
      throw ConfigError(fmt::format("--objective: runs of {} have no step metrics (allowed: rmse)", system().name));
  }

  /// Each end of a range is a value that the variant may have: refused before the first run, not at some step.
  void check_ends() const {
    const std::vector<double> at = start();
    for (std::size_t i = 0; i < at.size(); ++i)
      for (const double end : {settings_.free[i].low, settings_.free[i].high}) {
        std::vector<double> values = at;
        values[i] = end;
        training(values);
      }
  }

  const toml::table& variant() const { return *base_.resolved->root()["variant"][settings_.variant].as_table(); }

  void set(Document& document, const std::string& variant, const std::vector<double>& values) const {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const FreeParameter& p = settings_.free[i];
      set_number(document, variant, p.key, values[i], p.scale == FreeParameter::Scale::whole, "--free " + p.key);
    }
  }

  Campaign read(const std::vector<double>& values, const std::vector<std::string>& scenarios) const {
    Document document = *base_.resolved;
    set(document, settings_.variant, values);
    return read_campaign(std::move(document), {{settings_.variant}, scenarios});
  }

  const TuneSettings& settings_;
  const Campaign base_;
  std::vector<std::string> training_, held_out_;
  std::string identity_;
};

/// NLopt's loop around the campaigns: each value it asks for once.
class Tuner {
 public:
  Tuner(const TuneSettings& settings, const std::function<void(const TuneResult&)>& progress)
      : settings_(settings), progress_(progress), candidates_(settings) {
    create_folder(settings.out);
    result_.folder = settings.out;
    std::string identity = candidates_.identity();
    for (const FreeParameter& p : settings.free)
      identity += fmt::format(" {}={}..{}:{}", p.key, p.low, p.high, static_cast<int>(p.scale));
    identity += fmt::format(" {} {}", static_cast<int>(settings.aim), settings.algorithm);
    for (const auto& [key, limit] : settings.limits) identity += fmt::format(" {}={}", key, limit);
    result_.system = &candidates_.system();
    history_ = std::make_unique<TuneHistory>(settings.out, settings.free, candidates_.system(), fingerprint(identity));
  }

  TuneResult run() {
    const std::vector<double> start = candidates_.start();
    if (!begin_with(start)) return finish("interrupted");
    const auto count = static_cast<unsigned>(settings_.free.size());
    const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt)> search(nlopt_create(algorithm(), count), nlopt_destroy);
    search_ = search.get();
    nlopt_set_min_objective(search_, &Tuner::objective, this);
    nlopt_set_lower_bounds1(search_, 0.0);
    nlopt_set_upper_bounds1(search_, 1.0);
    nlopt_set_initial_step1(search_, first_step);
    nlopt_set_xtol_abs1(search_, converged);
    std::vector<double> point;
    for (std::size_t i = 0; i < count; ++i) point.push_back(settings_.free[i].point(start[i]));
    double least = 0.0;
    nlopt_optimize(search_, point.data(), &least);
    if (failure_) std::rethrow_exception(failure_);
    return finish(ended_.empty() ? "converged" : ended_);
  }

 private:
  nlopt_algorithm algorithm() const {
    for (const Algorithm& a : algorithms)
      if (settings_.algorithm == a.name) return a.id;
    throw ConfigError(fmt::format("--algorithm: '{}' is not known (allowed: {})", settings_.algorithm,
                                  fmt::join(tune_algorithms(), ", ")));
  }

  static double objective(unsigned count, const double* point, double*, void* self) {
    return static_cast<Tuner*>(self)->objective_at({point, count});
  }

  double objective_at(std::span<const double> point) {
    std::vector<double> values;
    for (std::size_t i = 0; i < point.size(); ++i) values.push_back(settings_.free[i].at(point[i]));
    for (const TuneStep& step : result_.steps)  // rounding may ask for the same again
      if (step.values == values) return step.training.objective;
    try {
      if (!evaluate(values)) stop("interrupted");
    } catch (...) {
      failure_ = std::current_exception();
      stop("failed");
    }
    const auto tried = static_cast<int>(result_.steps.size()) - 1;
    if (tried >= settings_.evaluations) stop("evaluations");
    if (tried - static_cast<int>(best_) >= settings_.patience) stop("patience");
    return result_.steps.back().training.objective;
  }

  void stop(const char* why) {
    if (ended_.empty()) ended_ = why;
    nlopt_force_stop(search_);
  }

  /// The first step: the variant as it is, which sets the limits that the user did not. False if interrupted.
  bool begin_with(const std::vector<double>& start) {
    result_.limits.clear();
    const TuneStep* known = history_->find(start);
    const auto training = known ? std::optional(known->training) : score(candidates_.training(start));
    if (!training) return false;
    result_.limits = training->efforts;
    const std::vector<MetricColumn> efforts = effort_metrics(candidates_.system());
    for (std::size_t i = 0; i < result_.limits.size(); ++i)
      if (const auto limit = settings_.limits.find(efforts[i].key); limit != settings_.limits.end())
        result_.limits[i] = limit->second;
    TuneStep step = known ? *known : TuneStep{start, with_limits(*training), {}};
    return add(std::move(step));
  }

  std::optional<Score> score(const Campaign& campaign) const {
    const auto records = settings_.run ? settings_.run(campaign) : run_in_processes(campaign, settings_.jobs);
    if (!records) return std::nullopt;
    return score_of(*records, result_.limits, settings_.aim);
  }

  /// The next step; false if interrupted.
  bool evaluate(const std::vector<double>& values) {
    if (const TuneStep* known = history_->find(values)) return add(*known);
    const auto training = score(candidates_.training(values));
    return training && add({values, *training, {}});
  }

  /// Judges an improvement by the held-out scenarios and keeps the step; false if interrupted.
  bool add(TuneStep step) {
    const bool better = result_.steps.empty() || step.training.objective < result_.steps[best_].training.objective;
    if (better && !step.held_out) {
      step.held_out = score(candidates_.held_out(step.values));
      if (!step.held_out) return false;
    }
    result_.steps.push_back(step);
    if (better) best_ = result_.steps.size() - 1;
    choose();
    history_->write(result_.steps);
    if (progress_) progress_(result_);
    return true;
  }

  Score with_limits(Score s) const {
    s.objective += effort_excess(s, result_.limits);
    return s;
  }

  void choose() {
    for (std::size_t i = 0; i < result_.steps.size(); ++i) {
      const auto& held_out = result_.steps[i].held_out;
      if (held_out && held_out->objective < result_.steps[result_.chosen].held_out->objective) result_.chosen = i;
    }
  }

  TuneResult finish(const std::string& ended) {
    result_.ended = ended;
    if (!result_.steps.empty()) {
      const auto tuned =
          std::make_shared<const Document>(candidates_.tuned_campaign(result_.steps[result_.chosen].values));
      write_inputs(candidates_.inputs(), settings_.out);
      write_file_atomically(settings_.out + "/tuned.toml", toml_text(tuned->root()) + "\n");
      result_.tuned = tuned;
    }
    return std::move(result_);
  }

  const TuneSettings& settings_;
  const std::function<void(const TuneResult&)>& progress_;
  Candidates candidates_;
  std::unique_ptr<TuneHistory> history_;
  TuneResult result_;
  std::size_t best_ = 0;
  nlopt_opt search_ = nullptr;
  std::string ended_;
  std::exception_ptr failure_;
};

}  // namespace

Score score_of(std::span<const RunRecord> records, const EffortLimits& limits, TuneAim aim) {
  Score s;
  s.runs = static_cast<int>(records.size());
  s.bad = static_cast<int>(std::ranges::count_if(records, [](const RunRecord& r) { return !r.ok(); }));
  const Ranking ranking = rank_variants(records);
  s.objective = bad_weight * s.bad / std::max(1, s.runs);
  if (ranking.variants.empty() || !ranking.variants.front().ranked) return s.objective += bad_weight, s;
  const RankedVariant& v = ranking.variants.front();
  s.error = v.error;
  s.worst_error = v.worst;
  s.efforts = v.efforts;
  judge_steps(records, s);
  s.objective += std::log(std::max(error_of(s, aim), least_error)) + effort_excess(s, limits);
  return s;
}

bool has_step_metrics(const SystemDescription& system) {
  const auto has = [&](const char* key) { return std::ranges::count(system.metrics, key, &MetricColumn::key) > 0; };
  return has("overshoot_percent") && has("sse_max_abs_mm");
}

std::vector<std::string> tune_algorithms() {
  std::vector<std::string> names;
  names.reserve(std::size(algorithms));
  for (const Algorithm& a : algorithms) names.push_back(a.name);
  return names;
}

std::string new_tuning_folder(const std::string& variant) {
  return fmt::format("results/tune-{}-{}", variant, compact_timestamp());
}

TuneResult tune(const TuneSettings& settings, const std::function<void(const TuneResult&)>& progress) {
  if (settings.free.empty()) throw ConfigError("--free: nothing to tune (allowed: at least one key with a range)");
  return Tuner(settings, progress).run();
}

}  // namespace solenoid
