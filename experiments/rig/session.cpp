#include "experiments/rig/session.hpp"

#include "core/metrics/percentile_sketch.hpp"
#include "core/rt/allocation_guard.hpp"
#include "core/rt/clock.hpp"
#include "core/safety/broken_limit_text.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/rig/background.hpp"
#include "experiments/rig/log/run_log.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr int safe_ticks = 25;         // commanded safe before the loop ends: longer than the node's own timeout
constexpr double most_kept_s = 120.0;  // of ticks for the metrics
constexpr double watch_s = 0.05;
constexpr double guard_look_s = 0.004;
constexpr double abandon_s = 2.0;

/// Collects what the summary needs, in the log's thread; its memory does not grow with the run's length.
class Statistics {
 public:
  Statistics(double duration_s, double tick_s) {
    kept_.reserve(static_cast<std::size_t>(std::min(duration_s, most_kept_s) / tick_s) + 1000);
  }
  void add(const TickRecord& t) {
    if (t.decision.safe_causes.has(Fault::stopped)) return;  // the end is no part of the task
    late_.add(t.timing.late_us);
    read_.add(t.timing.read_us);
    control_.add(t.timing.control_us);
    write_.add(t.timing.write_us);
    tick_.add(t.timing.total_us());
    if (t.decision.solved) solve_.add(t.decision.report.time_us);
    if (kept_.size() < kept_.capacity()) kept_.push_back(t);
  }
  SessionTiming timing() const {
    return {late_.percentiles(),  read_.percentiles(), control_.percentiles(),
            write_.percentiles(), tick_.percentiles(), solve_.percentiles()};
  }
  const std::vector<TickRecord>& kept() const { return kept_; }

 private:
  PercentileSketch late_, read_, control_, write_, tick_, solve_;
  std::vector<TickRecord> kept_;
};

std::uint64_t wall_ns() {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
          .count());
}

/// What the tick thread and the one that waits for it share.
struct Shared {
  std::atomic<bool> ended{false}, abandoned{false};
  std::atomic<std::int64_t> beats{0};  ///< ticks begun and ended
  std::vector<SetupStep> setup;
  LoopCounts loop;
  FaultSet causes;
  double last_s = 0.0;
  std::int64_t allocations = 0;
};

/// Ends the loop: at the end of the task, or of a SAFE nobody re-armed, through some ticks of safe commands.
class Ending {
 public:
  Ending(FallbackLadder& ladder, const SessionSettings& settings, double tick_s)
      : ladder_(ladder), settings_(settings), tick_s_(tick_s) {}
  bool operator()(const TickRecord& tick) noexcept {
    const double t = tick.sensors.time_s;
    if (t >= settings_.duration_s) ladder_.request_stop();
    if (!ladder_.safe())
      safe_since_s_ = -1.0;
    else if (safe_since_s_ < 0)
      safe_since_s_ = t;
    if (safe_since_s_ < 0) return false;
    const bool stopped = tick.decision.safe_causes.has(Fault::stopped) || tick.decision.safe_causes.has(Fault::aborted);
    const double patience = stopped ? 0.0 : settings_.rearm_wait_s;
    return t - safe_since_s_ >= std::max(patience, settings_.ladder.lowering_s) + safe_ticks * tick_s_;
  }

 private:
  FallbackLadder& ladder_;
  const SessionSettings& settings_;
  double tick_s_, safe_since_s_ = -1.0;
};

/// The recorder of the loop: the log, and the last tick for whoever ends it.
struct Tap {
  RunLog& log;
  std::atomic<std::int64_t>& beats;
  TickRecord last;
  void record(const TickRecord& tick) noexcept {
    last = tick;
    beats.fetch_add(1, std::memory_order_relaxed);
    log.record(tick);
  }
};

void tick_thread(Plant& plant, FallbackLadder& ladder, CommandLimits& limits, RunLog& log,
                 const SessionSettings& settings, double tick_s, Shared& shared) {
  prepare_thread("tick");
  if (settings.tick_core >= 0) shared.setup.push_back(pin_to_core("tick", settings.tick_core));
  if (settings.tick_priority > 0) shared.setup.push_back(set_fifo_priority("tick", settings.tick_priority));
  MonotonicClock clock;
  Tap tap{log, shared.beats, {}};
  ControlLoop loop(plant, clock, ladder, limits, tap);
  Ending ending(ladder, settings, tick_s);
  const auto most = static_cast<std::int64_t>((settings.duration_s + settings.rearm_wait_s + 3600.0) / tick_s);
  const std::int64_t before = AllocationGuard::thread_allocations();
  loop.run(most, tick_s, [&] { return ending(tap.last); });
  shared.allocations = AllocationGuard::thread_allocations() - before;
  plant.write(limits.safe_command());
  settings.after_last_tick();
  shared.loop = loop.counts();
  shared.causes = tap.last.decision.safe_causes;
  shared.last_s = tap.last.sensors.time_s;
  shared.ended.store(true);
}

/// Looks after a tick that does not come back from a read or a write: makes the plant safe past it, and gives up after
/// abandon_s. If the tick comes back, its ladder finds the gap and stays safe.
void guard_thread(const SessionSettings& settings, double tick_s, Shared& shared) {
  prepare_thread("guard");
  if (settings.tick_priority > 0) set_fifo_priority("guard", settings.tick_priority + 5);
  MonotonicClock clock;
  std::int64_t seen = 0;
  double seen_s = clock.now_s();
  bool made_safe = false;
  while (!shared.ended.load() && !shared.abandoned.load()) {
    clock.sleep_until(clock.now_s() + guard_look_s);
    const std::int64_t beats = shared.beats.load(std::memory_order_relaxed);
    const double now_s = clock.now_s();
    if (beats != seen || beats == 0) {
      seen = beats;
      seen_s = now_s;
      made_safe = false;
    } else if (now_s - seen_s > settings.ladder.longest_gap_ticks * tick_s) {
      if (!made_safe) settings.after_last_tick();
      made_safe = true;
      if (now_s - seen_s > abandon_s) shared.abandoned.store(true);
    }
  }
}

/// Until the tick thread has ended: interrupts, re-arms, a failing log, and something to look at.
void wait_for(const Shared& shared, FallbackLadder& ladder, RunLog& log, const SessionWatch& watch,
              SessionResult& result) {
  while (!shared.ended.load() && !shared.abandoned.load()) {
    std::this_thread::sleep_for(std::chrono::duration<double>(watch_s));
    if (!result.interrupted && watch.interrupted()) {
      result.interrupted = true;
      ladder.request_stop();
    }
    if (log.failed()) ladder.request_stop(Fault::aborted);
    if (watch.rearm_wanted()) ladder.request_rearm();
    if (log.newest().take()) watch.show(log.newest().front());
  }
}

/// The disk as the fault script has it, on the time since now.
std::function<ssize_t(int, const char*, std::size_t)> disk_with(const std::vector<InjectedFault>& faults) {
  std::vector<InjectedFault> of_disk;
  std::ranges::copy_if(faults, std::back_inserter(of_disk), [](const auto& f) { return f.target == "disk"; });
  if (of_disk.empty()) return ::write;
  return [of_disk, clock = MonotonicClock()](int file, const char* bytes, std::size_t size) -> ssize_t {
    for (const InjectedFault& f : of_disk) {
      if (!f.active(clock.now_s())) continue;
      if (f.kind == "slow") {
        std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(f.value));
        continue;
      }
      errno = f.kind == "full" ? ENOSPC : EROFS;
      return -1;
    }
    return ::write(file, bytes, size);
  };
}

RunLogSettings log_settings(const SessionSettings& settings, const SystemDescription& system) {
  RunLogSettings log{.system = &system,
                     .folder = settings.log_folder,
                     .name = settings.log_name,
                     .start_ns = wall_ns(),
                     .udp_ports = settings.udp_ports,
                     .live_socket = settings.live_socket,
                     .switches = {},
                     .about = settings.about,
                     .write = disk_with(settings.faults)};
  log.about["start_ns"] = std::to_string(log.start_ns);
  return log;
}

/// Has the ladder begin where the plant stands; the log says where, for a replay.
void begin_off_the_start(Plant& plant, const SystemDescription& system, FallbackLadder& ladder, RunLogSettings& log) {
  const Measurement now = plant.read(0.0);
  AxisValues from{};
  for (std::size_t a = 0; a < system.axes.size(); ++a) {
    from[a] = now.value[system.axes[a].channel];
    log.about[restart_key(system, a)] = fmt::format("{}", from[a]);
  }
  ladder.restart(0.0, from);
}

/// A tick thread that does not come back cannot be ended, and it uses everything here: the program ends as a whole.
[[noreturn]] void leave(const SessionSettings& settings, RunLog& log) {
  settings.after_last_tick();
  log.close({{"ended_in", "a tick that did not come back"}});
  std::fprintf(stderr, "solenoid: the plant's read or write did not come back; outputs made safe, log closed\n");
  std::_Exit(1);
}

/// What the threads, the ladder and the limits counted.
void take_counts(Shared& shared, const FallbackLadder& ladder, const CommandLimits& limits,
                 const VariantConfig& variant, SessionResult& result) {
  result.loop = shared.loop;
  result.causes = shared.causes;
  result.ended_s = shared.last_s;
  result.allocations_in_tick = shared.allocations;
  result.ladder = ladder.counts();
  if (const LadderCounts& counts = result.ladder; counts.infeasible > 0)
    result.infeasible = fmt::format("at {:.3f} s {}", counts.first_infeasible_s,
                                    broken_limit_text(counts.first_broken, system_of(variant).description(),
                                                      system_of(variant).modes(variant), variant.timing.tick_s));
  result.refused_commands = limits.refused();
  result.slowed_commands = limits.slowed();
  std::ranges::move(shared.setup, std::back_inserter(result.setup));
}

std::map<std::string, std::string> log_summary(const SessionResult& result, const SystemDescription& system) {
  return {{"ticks", std::to_string(result.loop.ticks)},
          {"skipped", std::to_string(result.loop.skipped)},
          {"late", std::to_string(result.loop.late)},
          {"ended_in", to_string(result.causes, system)}};
}

}  // namespace

std::string restart_key(const SystemDescription& system, std::size_t axis) {
  const Signal& signal = system.axes[axis].signal;
  return system.axes.size() == 1 ? "restart_" + signal.unit : fmt::format("restart_{}_{}", signal.name, signal.unit);
}

bool SessionResult::clean() const {
  FaultSet stopped;
  stopped.add(Fault::stopped);
  return causes == stopped && log_problem.empty();
}

SessionResult run_session(Plant& plant, const VariantConfig& chosen, const ScenarioConfig& scenario,
                          const SessionSettings& settings, const SessionWatch& watch) {
  require_real_time(chosen);
  SessionResult result;
  VariantConfig variant = told(chosen, scenario);
  const SystemDescription& system = system_of(variant).description_for(variant);
  const Timing& timing = variant.timing;
  variant.latency_ticks = settings.policy == PlanPolicy::next_slot ? timing.ticks_per_period : 0;
  result.setup.push_back(lock_memory());
  SolverThreadSettings solver;
  solver.period_s = timing.period_s();
  solver.lead_s = timing.tick_s;
  solver.priority = settings.solver_priority;
  solver.core = settings.solver_core;
  const auto ladder =
      make_ladder(variant, scenario.trajectory, settings.ladder, in_background(solver, settings.faults));
  CommandLimits limits = make_limits(variant);
  limits.set_rates(settings.rates);
  Statistics statistics(settings.duration_s, timing.tick_s);
  RunLogSettings to = log_settings(settings, system);
  if (&system != &system_of(variant).description()) to.about["inputs"] = input_names(system);
  const ModeSet modes = system_of(scenario).modes(variant);
  for (const Switch& s : modes.switches()) to.switches.push_back(s.name);
  if (!settings.at_start_position) begin_off_the_start(plant, system, *ladder, to);
  RunLog log(to, [&](const TickRecord& tick) { statistics.add(tick); });

  Shared shared;
  std::thread thread([&] { tick_thread(plant, *ladder, limits, log, settings, timing.tick_s, shared); });
  std::thread guard([&] { guard_thread(settings, timing.tick_s, shared); });
  wait_for(shared, *ladder, log, watch, result);
  guard.join();
  if (shared.abandoned.load()) leave(settings, log);
  thread.join();

  take_counts(shared, *ladder, limits, variant, result);
  result.log_path = log.path();
  result.log_problem = log.close(log_summary(result, system));
  result.timing = statistics.timing();
  const auto* simulated = dynamic_cast<const SimulatedPlant*>(&plant);
  result.metrics = simulation_of(scenario).evaluate(variant, scenario, statistics.kept(),
                                                    {.total = simulated ? simulated->consumed() : 0.0});
  return result;
}

}  // namespace solenoid
