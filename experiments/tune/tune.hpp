#pragma once

#include "experiments/campaign/run_campaign.hpp"
#include "experiments/tune/free_parameter.hpp"

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace solenoid {

class Document;

/// What of a run is made small: the error along a motion, or what chapter 5 chose N_p by in step tests.
enum class TuneAim { rmse, step };

/// How good a variant is on a group of scenarios. What is minimised:
///
///     J = ln(E) + 5 sum_i max(0, ln(e_i / e_i_max)) + 10 bad / runs
///
///     rmse   E = the system's judged metric (the RMSE of the true position), its geometric mean over the runs
///     step   E = |(overshoot / 35 %, SSE / 10 mm)|, means over the runs in units of the ranges of Table 5-2; SSE the
///            largest absolute error of the steady part: of systems that have these metrics
///
/// e_i the system's efforts (switches per second, supply air of a run), bad the runs that did not end well.
struct Score {
  double objective = 0.0, error = 0.0, worst_error = 0.0, overshoot_percent = 0.0, sse_mm = 0.0;
  std::vector<double> efforts;  ///< in the order of the description's
  int runs = 0, bad = 0;
};

/// What J forgives: one number an effort.
using EffortLimits = std::vector<double>;
Score score_of(std::span<const RunRecord> records, const EffortLimits& limits, TuneAim aim = TuneAim::rmse);

/// A tuning run: which keys of a variant, how judged, how long.
struct TuneSettings {
  std::string campaign = "tuning", variant;
  std::shared_ptr<const Document> document;  ///< of the campaign, in place of the file's
  std::vector<FreeParameter> free;
  TuneAim aim = TuneAim::rmse;
  std::string algorithm = "subplex";     ///< of tune_algorithms()
  int evaluations = 60;                  ///< on the training scenarios, at most
  int patience = 25;                     ///< ends after so many without a better one
  std::map<std::string, double> limits;  ///< of efforts, by their metrics' keys; none: what the variant needs as it is
  int jobs = 0;                          ///< worker processes; 0: one a core
  std::string out;                       ///< folder; one that is there already is resumed
  CampaignRunner run = {};               ///< what evaluates; none: processes here
};
/// Whether a system's runs have what TuneAim::step judges.
bool has_step_metrics(const SystemDescription& system);
/// results/tune-VARIANT-DATE-TIME below the current folder.
std::string new_tuning_folder(const std::string& variant);
/// NLopt's, all without derivatives and deterministic.
std::vector<std::string> tune_algorithms();

/// One set of values tried. Held-out scenarios are looked at when the training objective has improved.
struct TuneStep {
  std::vector<double> values;  ///< of `free`
  Score training;
  std::optional<Score> held_out;
};

struct TuneResult {
  std::vector<TuneStep> steps;  ///< steps[0]: the variant as it is, or as near to it as the ranges go
  std::size_t chosen = 0;       ///< of the improvements, the one that is best on the held-out scenarios
  EffortLimits limits;
  const SystemDescription* system = nullptr;
  std::string ended;  ///< "evaluations" | "patience" | "converged" | "interrupted"
  std::string folder;
  std::shared_ptr<const Document> tuned;  ///< what tuned.toml has; none without a step
  bool interrupted() const { return ended == "interrupted"; }
};

/// Scenarios whose names begin with "held_out" judge; the others train. Early stopping: what is chosen is the
/// improvement with the least held-out objective, so later ones that only fit the training scenarios are not. The
/// folder gets history.csv, which an interrupted run resumes from without repeating an evaluation, and tuned.toml, a
/// campaign of the held-out scenarios with the variant and VARIANT_tuned, the files it names beside it. `progress` is called after each step. Throws
/// ConfigError for an unknown variant, a key the variant cannot have, a campaign without either kind of scenario, or a
/// folder with another tuning run in it.
TuneResult tune(const TuneSettings& settings, const std::function<void(const TuneResult&)>& progress = {});

}  // namespace solenoid
