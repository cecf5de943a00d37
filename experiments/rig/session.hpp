#pragma once

#include "controllers/ladder/fallback_ladder.hpp"
#include "core/metrics/metrics.hpp"
#include "core/rt/control_loop.hpp"
#include "core/rt/process_setup.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/rig/fault_script.hpp"
#include "experiments/rig/rig_io.hpp"

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// When a plan takes effect.
enum class PlanPolicy {
  at_once,    ///< in the tick it is finished: for solvers of a fraction of a slot
  next_slot,  ///< at the next slot's beginning, the state predicted forward to it: for solvers that need the slot
};

/// How a run is executed in real time.
struct SessionSettings {
  double duration_s = 8.0;
  PlanPolicy policy = PlanPolicy::at_once;
  int tick_priority = 80, solver_priority = 70;  ///< SCHED_FIFO; 0: as they are
  int tick_core = -1, solver_core = -1;          ///< -1: wherever
  LadderSettings ladder;                         ///< of the system, mostly System::ladder()
  CommandRates rates;
  std::vector<InjectedFault> faults;  ///< of the solver and the disk; the plant has its own
  bool at_start_position = true;      ///< the plant stands where the task begins
  double rearm_wait_s = 0.0;          ///< in SAFE: wait so long for a re-arm before the run ends
  std::string log_folder, log_name = "run";
  std::vector<int> udp_ports;  ///< of 127.0.0.1, which get every tenth tick as JSON
  int live_socket = -1;        ///< of the live page, which gets the same as a message
  std::map<std::string, std::string> about;
  std::function<void()> after_last_tick = [] {};  ///< before the log is closed: the plant's own safe state
};

/// Percentiles of what each tick took [us], and of the slots' solves, within 0.1 % (PercentileSketch).
struct SessionTiming {
  Percentiles late, read, control, write, tick, solve;
};

/// What became of a run.
struct SessionResult {
  Metrics metrics;
  SessionTiming timing;
  LoopCounts loop;
  LadderCounts ladder;
  std::optional<IoHealth> io;  ///< of a plant behind wires
  std::int64_t refused_commands = 0, slowed_commands = 0, allocations_in_tick = 0;
  FaultSet causes;         ///< of the SAFE the run ended in; `stopped` alone is a clean end
  double ended_s = 0.0;    ///< time of the last tick
  std::string infeasible;  ///< of ladder.infeasible problems the first, in words
  std::string log_path, log_problem;
  std::vector<SetupStep> setup;
  bool interrupted = false;

  bool clean() const;
};

/// What a person may do and see while it runs; called from the waiting thread, some times a second.
struct SessionWatch {
  std::function<bool()> interrupted = [] { return false; };
  std::function<bool()> rearm_wanted = [] { return false; };
  std::function<void(const TickRecord&)> show = [](const TickRecord&) {};
};

/// The key in a log of where an axis's task began, if not at its motion's start.
std::string restart_key(const SystemDescription& system, std::size_t axis);

/// Runs a variant on a plant in real time: a tick thread, a solver thread, a log thread. Whatever ends it, the last
/// commands are safe ones, and then the log is closed. Throws ConfigError, OutputError or what the solver throws when
/// it is prepared, all before the first command.
SessionResult run_session(Plant& plant, const VariantConfig& variant, const ScenarioConfig& scenario,
                          const SessionSettings& settings, const SessionWatch& watch);

}  // namespace solenoid
