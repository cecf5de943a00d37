#include "experiments/rig/replay_run.hpp"

#include "controllers/factory.hpp"
#include "core/config/document.hpp"
#include "core/config/reader.hpp"
#include "core/rt/deferred_solver.hpp"
#include "experiments/base/shown_text.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/rig/plants.hpp"
#include "experiments/rig/session.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <chrono>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <set>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// What a log says of its plans: the tick that one arrives in, and which were made from an anticipated problem.
struct LoggedPlans {
  std::int64_t arriving = -1;  ///< ticket of the plan that arrives in the tick at hand; -1: none
  int ticks_per_period;
  std::set<std::int64_t> anticipated{};  ///< slots

  LoggedPlans(const RecordedRun& run, const Timing& timing) : ticks_per_period(timing.ticks_per_period) {
    for (const TickRecord& tick : run.ticks)
      if (tick.decision.solved && tick.decision.report.anticipated)
        anticipated.insert(tick.decision.ticket / ticks_per_period);
  }
};

/// Solves when it is posted to, and hands plans out in the ticks the log names.
class LoggedArrivals final : public DeferredSolver {
 public:
  LoggedArrivals(AnySolverPtr solver, const LoggedPlans& log)
      : solver_(std::move(solver)), log_(log), posted_(-log.ticks_per_period) {}

  void post(std::int64_t ticket, const AnyProblem& problem, const AnyPlan& warm_start, double) noexcept override {
    Finished& slot = kept_[slot_of(ticket) % kept_.size()];
    slot.ticket = posted_ = ticket;
    slot.plan->assign(warm_start);
    slot.report = solver_->solve(problem, *slot.plan, Deadline::never());
  }
  const Finished* collect() noexcept override {
    if (log_.arriving < 0) return nullptr;
    const Finished& slot = kept_[slot_of(log_.arriving) % kept_.size()];
    return slot.ticket == log_.arriving ? &slot : nullptr;
  }
  bool anticipates() const override { return solver_->anticipates(); }

 private:
  void do_prepare(const AnyProblem& problem) override {
    solver_->prepare(problem);
    kept_.fill({-1, Held(problem.new_plan()), {}});
  }
  SolveReport do_solve(const AnyProblem& problem, AnyPlan& plan, Deadline deadline) noexcept override {
    return solver_->solve(problem, plan, deadline);
  }
  void do_anticipate(const AnyProblem& expected, const AnyPlan& warm_start) noexcept override {
    if (log_.anticipated.contains(posted_ / log_.ticks_per_period + 1)) solver_->anticipate(expected, warm_start);
  }
  std::size_t slot_of(std::int64_t ticket) const { return static_cast<std::size_t>(ticket / log_.ticks_per_period); }

  AnySolverPtr solver_;
  const LoggedPlans& log_;
  std::int64_t posted_;
  std::array<Finished, 256> kept_{};  // a plan later than 256 periods came from no controller of ours
};

/// What a person or the end of the run did to the ladder in this tick.
void repeat_requests(const TickRecord& tick, const TickRecord* next, FallbackLadder& ladder) {
  for (const Fault why : {Fault::stopped, Fault::aborted})
    if (tick.decision.safe_causes.has(why)) ladder.request_stop(why);
  if (next && tick.decision.rung == Rung::safe && next->decision.rung != Rung::safe) ladder.request_rearm();
}

/// Sums squares into continuous_difference_rms.
void compare(const TickRecord& logged, const Command& then, const Decision& decided, ReplayResult& result) {
  bool other = then.switches != decided.command.switches;
  result.switch_differences += other;
  for (std::size_t i = 0; i < max_continuous; ++i) {
    const double apart = then.continuous[i] - decided.command.continuous[i];
    result.continuous_differences[i] += apart != 0.0;
    result.continuous_difference_rms[i] += apart * apart;
    other = other || apart != 0.0;
  }
  if (other && result.first_difference_s < 0) result.first_difference_s = logged.sensors.time_s;
}

[[noreturn]] void refuse_said(const RecordedRun& run, const std::string& key, const std::string& value,
                              const std::string& allowed) {
  throw ConfigError(
      fmt::format("{}: metadata 'run', key '{}': {} (allowed: {})", run.path, key, shown(value), allowed));
}

const std::string& said(const RecordedRun& run, const std::string& key) {
  const auto value = run.about.find(key);
  if (value == run.about.end())
    throw ConfigError(fmt::format("{}: metadata 'run': no key '{}' (allowed: a log of `solenoid run`)", run.path, key));
  return value->second;
}

double number_said(const RecordedRun& run, const std::string& key, double low, double high) {
  const std::string& text = said(run, key);
  double value = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end.ec != std::errc() || end.ptr != text.data() + text.size() || !(value >= low && value <= high))
    refuse_said(run, key, text, fmt::format("a number from {} to {}", low, high));
  return value;
}

/// Runs `read` on a text of the log's metadata. What it complains of is the log's: "FILE, its recorded campaign, line 7".
template <class Read>
auto of_log(const RecordedRun& run, const char* what, Read read) {
  const std::string name = fmt::format("{}, its recorded {}", run.path, what);
  try {
    return read(name);
  } catch (const ConfigError& error) {
    std::string text = error.what();
    if (text.starts_with(name + ":") && std::isdigit(static_cast<unsigned char>(text[name.size() + 1])) != 0)
      text.replace(name.size(), 1, ", line ");
    throw ConfigError(text.starts_with(name) ? text : fmt::format("{}: {}", name, text));
  }
}

/// Where the run's task began, one number an axis, if not at the motion's start.
std::optional<AxisValues> restart_of(const RecordedRun& run) {
  AxisValues from{};
  bool said = false;
  for (std::size_t a = 0; a < run.system->axes.size(); ++a)
    if (const auto at = run.about.find(restart_key(*run.system, a)); at != run.about.end()) {
      from[a] = number_said(run, at->first, -1e6, 1e6);
      said = true;
    }
  if (!said) return std::nullopt;
  return from;
}

void check_patterns(const RecordedRun& run, const ModeSet& logged) {
  const SwitchPattern most = first_switches(static_cast<std::size_t>(logged.switch_count()));
  const auto check = [&](const TickRecord& tick, const char* what, SwitchPattern pattern) {
    if (pattern > most)
      throw ConfigError(fmt::format("{}: its tick at {:.3f} s {} the pattern {} (allowed: 0 to {})", run.path,
                                    tick.sensors.time_s, what, pattern, most));
  };
  for (const TickRecord& tick : run.ticks) {
    check(tick, "applied", tick.applied.switches);
    check(tick, "decided", tick.decision.command.switches);
  }
}

/// `from`, `to`: the mode sets of the log and of the ladder.
ReplayResult through(const RecordedRun& run, FallbackLadder& ladder, const ModeSet& from, const ModeSet& to,
                     LoggedPlans* plans, const Interrupted& interrupted) {
  check_patterns(run, from);
  const auto translated = [&](Command command) {
    command.switches = translated_pattern(from, to, command.switches);
    return command;
  };
  using Clock = std::chrono::steady_clock;
  ReplayResult result;
  std::vector<double> solve_us, step_us;
  if (const auto from = restart_of(run)) ladder.restart(0.0, *from);
  for (const TickRecord& logged : run.ticks) {
    result.interrupted = interrupted && interrupted();
    if (result.interrupted) break;
    if (plans) plans->arriving = logged.decision.solved ? logged.decision.ticket : -1;
    repeat_requests(logged, &logged != &run.ticks.back() ? &logged + 1 : nullptr, ladder);
    const auto begin = Clock::now();
    const Decision d = ladder.step(logged.sensors);
    step_us.push_back(us_since(begin));
    ladder.applied(translated(logged.applied));
    compare(logged, translated(logged.decision.command), d, result);
    if (d.solved) solve_us.push_back(d.report.time_us);
    if (logged.decision.solved && logged.decision.report.status == Status::deadline_reached) ++result.unproven;
    result.decided.push_back(logged);
    result.decided.back().decision = d;
  }
  result.ticks = static_cast<std::int64_t>(result.decided.size());
  for (double& sum : result.continuous_difference_rms)
    sum = std::sqrt(sum / static_cast<double>(std::max<std::int64_t>(1, result.ticks)));
  result.solve_us = percentiles(solve_us);
  result.step_us = percentiles(step_us);
  return result;
}

}  // namespace

SwitchPattern translated_pattern(const ModeSet& from, const ModeSet& to, SwitchPattern pattern) {
  const SwitchedPoint point = from.point(pattern);
  const auto apart = [&](SwitchPattern other) {
    const SwitchedPoint there = to.point(other);
    return std::transform_reduce(point.begin(), point.end(), there.begin(), 0.0, std::plus(),
                                 [](double x, double y) { return (x - y) * (x - y); });
  };
  const bool known = (pattern & ~first_switches(static_cast<std::size_t>(to.switch_count()))) == 0;
  if (known && apart(pattern) == 0.0) return pattern;
  return std::ranges::min_element(to.modes(), {}, [&](const Mode& mode) { return apart(mode.pattern); })->pattern;
}

Campaign recorded_campaign(const RecordedRun& run, std::vector<std::string> variants) {
  if (variants.empty()) variants = {said(run, "variant")};
  return of_log(run, "campaign", [&](const std::string& name) {
    return read_campaign(Document::from_text(said(run, "campaign"), name),
                         {variants, {said(run, "scenario")}, {}, false});
  });
}

RecordedTask recorded_task(const RecordedRun& run) {
  const Campaign campaign = recorded_campaign(run);
  const ScenarioConfig& scenario = campaign.scenarios.front();
  const VariantConfig variant = told(campaign.variants.front(), scenario);
  PlantChoice choice;
  choice.rig = of_log(run, "rig file", [&](const std::string& name) {
    return read_rig(TableReader::from_text(said(run, "rig"), name), variant);
  });
  const auto also_said = [&](const char* key, std::string& value) {
    if (const auto it = run.about.find(key); it != run.about.end()) value = it->second;
  };
  also_said("plant", choice.kind);
  also_said("node", choice.address);
  of_log(run, "node", [&](const std::string&) { return expect_noise(choice, scenario), 0; });
  RecordedTask task{variant, scenario, choice.rig.ladder};
  task.ladder.lowering_s = number_said(run, "lowering_s", 0.0, 5.0);
  task.variant.latency_ticks = said(run, "policy") == "next_slot" ? task.variant.timing.ticks_per_period : 0;
  return task;
}

ReplayResult replay_same(const RecordedRun& run, const RecordedTask& task, const Interrupted& interrupted) {
  LoggedPlans plans(run, task.variant.timing);
  const SolverDecorator as_logged = [&](AnySolverPtr solver) {
    return std::make_unique<LoggedArrivals>(std::move(solver), plans);
  };
  const auto ladder = make_ladder(task.variant, task.scenario.trajectory, task.ladder, as_logged);
  const ModeSet modes = system_of(task.variant).modes(task.variant);
  return through(run, *ladder, modes, modes, &plans, interrupted);
}

ReplayResult replay_other(const RecordedRun& run, const RecordedTask& task, const VariantConfig& variant,
                          const SolverDecorator& decorate, const Interrupted& interrupted) {
  if (variant.system != task.variant.system)
    throw ConfigError(fmt::format("variant '{}' is of {}, {} of {} (allowed: a variant of the log's system)",
                                  variant.name, system_of(variant).name(), run.path, system_of(task.variant).name()));
  const VariantConfig timed_alike = told(variant, task.scenario);
  const auto ladder = make_ladder(timed_alike, task.scenario.trajectory, task.ladder, decorate);
  return through(run, *ladder, system_of(task.variant).modes(task.variant), system_of(variant).modes(variant), nullptr,
                 interrupted);
}

}  // namespace solenoid
