#pragma once

#include "controllers/any_solver.hpp"
#include "controllers/ladder/fallback_ladder.hpp"
#include "controllers/variant.hpp"
#include "core/metrics/metrics.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/scenario.hpp"
#include "experiments/rig/log/recorded_run.hpp"

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace solenoid {

/// A recorded measurement stream through a controller.
struct ReplayResult {
  std::int64_t ticks = 0;
  std::int64_t switch_differences = 0;  ///< ticks whose decided pattern is another
  /// Of each continuous input: ticks in which it is another, and by how much, root mean square.
  std::array<std::int64_t, max_continuous> continuous_differences{};
  ContinuousValues continuous_difference_rms{};
  double first_difference_s = -1.0;
  std::int64_t unproven = 0;  ///< solves the log's deadline cut short: another machine may end elsewhere
  Percentiles solve_us, step_us;
  std::vector<TickRecord> decided;  ///< the log's ticks with the decisions of the replay
  bool interrupted = false;         ///< `decided` has the ticks before that
};

/// Asked before each tick whether to leave off.
using Interrupted = std::function<bool()>;

/// The variant, task and limits a log was made with.
struct RecordedTask {
  VariantConfig variant;
  ScenarioConfig scenario;
  LadderSettings ladder;
};
/// Throws ConfigError if the log does not say.
RecordedTask recorded_task(const RecordedRun& run);
/// The campaign of its scenario alone, with these variants: its own or shipped ones; none: its own. Throws ConfigError.
Campaign recorded_campaign(const RecordedRun& run, std::vector<std::string> variants = {});

/// Through the controller the log was made with: plans arrive in the ticks they arrived in, the operator's stops and
/// re-arms come when they came. The same program gives the same commands.
ReplayResult replay_same(const RecordedRun& run, const RecordedTask& task, const Interrupted& interrupted = {});

/// The pattern of `to` that switches the model's inputs as `pattern` of `from` does: the same number where that does,
/// otherwise that of its mode nearest to it by least squares, the first of several.
SwitchPattern translated_pattern(const ModeSet& from, const ModeSet& to, SwitchPattern pattern);

/// Through any variant under the same limits, each solve done in its tick: what it would have done, and how long it
/// takes. It is told what was applied then, in its own switches. `decorate` gets its solver first. Throws ConfigError if
/// the log has patterns that its mode set does not have.
ReplayResult replay_other(const RecordedRun& run, const RecordedTask& task, const VariantConfig& variant,
                          const SolverDecorator& decorate = {}, const Interrupted& interrupted = {});

}  // namespace solenoid
