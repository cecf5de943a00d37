#pragma once

#include "core/rt/controller.hpp"

#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// What a provoked fault led to. Times are in milliseconds of the plant's time; -1: it did not happen.
struct FaultOutcome {
  std::string name, fault;
  bool moving = false;
  double detected_ms = -1;  ///< from the fault to the first tick that notices: a fault flag, or a rung below fresh
  double acted_ms = -1;     ///< from the notice to the first command of a rung that answers it
  Rung worst = Rung::fresh, last = Rung::fresh;
  FaultSet causes;                ///< of SAFE
  Command final_command;          ///< what left last
  double largest_error_mm = 0.0;  ///< of the true position, after the fault
  bool in_range = true;           ///< every command that left was an allowed one
  std::string note;
};

/// The faults of sensors, valves, supply and solver, at rest and moving, on a clock of simulated time: the rig's own
/// loop, ladder and exit around the twin. The same program gives the same table. Throws ConfigError for a variant that
/// is not known or not real time.
std::vector<FaultOutcome> simulated_faults(const std::string& variant);

/// Each coil of the variant stuck open and stuck closed, at rest and moving, found and done without: `valve_health` is
/// on. The note says which coil was called failed, and as what.
std::vector<FaultOutcome> coil_faults(const std::string& variant);

/// One of them: `fault` in the grammar of fault_script.hpp, its time included; re-armed at `rearm_at_s` if not
/// negative.
FaultOutcome simulate_fault(const std::string& variant, const std::string& name, const std::string& fault, bool moving,
                            double until_s, double rearm_at_s = -1.0);

/// What became of a process-level fault: a controller and an emulated node as two processes of this program.
struct ProcessOutcome {
  std::string name;
  int exit_code = 0;                     ///< of `run`; 128 + signal if one ended it
  int node_exit_code = 0;                ///< likewise; -1: it had to be killed
  double safe_after_ms = -1;             ///< node: last command to safe outputs, if it had to time out
  double longest_silence_ms = 0;         ///< node: between two commands
  Command final_outputs;                 ///< of the node
  std::int64_t refused = 0;              ///< commands the node refused
  std::int64_t sessions = 0, asked = 0;  ///< of the node: begun, and other controllers that it told to wait
  std::int64_t log_ticks = 0;            ///< that can be read back
  bool log_closed = false;
  double noticed_ms = -1;            ///< run: after a fault of the plant, of the firmware's image
  std::int64_t watchdog_resets = 0;  ///< of the image's board
  std::string causes;
  std::string results;  ///< where its files' names begin
};

/// Signals, lost processes and wires, disks: real processes in real time, some seconds each. `program`: this program's
/// file; `folder`: for their results; `variant`: what they run; `image`: with the firmware's image in the emulated
/// node's place, and faults of the plant too.
std::vector<ProcessOutcome> process_faults(const std::string& program, const std::string& folder,
                                           const std::string& variant, bool image = false);

Result result_of(const std::vector<FaultOutcome>& simulated, const std::vector<ProcessOutcome>& processes);

}  // namespace solenoid
