#pragma once

#include "core/mpc/plan.hpp"
#include "core/mpc/switch_fault.hpp"
#include "core/reference/motion.hpp"
#include "core/rt/io.hpp"
#include "core/safety/faults.hpp"

#include <string>

namespace solenoid {

/// An estimator says here what it believes beyond the state, and how well it believes to know it.
struct EstimateDetail {
  std::array<double, max_beliefs> belief{};  ///< in the order of the system's description; zeros where it does not say
  StateValues sigma{};                       ///< standard deviations of the states
  double innovation = 0.0;  ///< normalised innovation squared of the tick, chi-square with a degree a channel
};

/// A rung of the degradation ladder is what stands behind a command, from best to worst (docs/reference/realtime.md).
enum class Rung : std::uint8_t {
  fresh,    ///< the plan made for this slot
  shifted,  ///< an older plan, at its own later blocks
  held,     ///< a few modes held over the horizon, searched in the tick itself
  backup,   ///< the system's backup law alone, the switches safe
  safe,     ///< latched: switches safe, continuous inputs 0, after a bounded lowering stage if there is one
};
/// The rung as a system's logs spell it.
inline const std::string& to_string(Rung rung, const SystemDescription& system) {
  return system.rung_names[static_cast<std::size_t>(rung)];
}

/// A decision is what a controller commands in a tick, with what it believed and planned.
struct Decision {
  Command command;
  StateValues estimate{};
  EstimateDetail detail;
  ReferenceSample reference;
  AxisValues offset{};       ///< integral offset added to the reference of the switched inputs
  bool solved = false;       ///< whether `report` belongs to this tick
  std::int64_t ticket = -1;  ///< of a plan that arrived in this tick: the tick its problem was posed in
  SolveReport report;
  Rung rung = Rung::fresh;
  bool planned = true;     ///< whether any plan stands behind the switches
  int plan_age = 0;        ///< ticks since the plan's first block began
  FaultSet faults;         ///< seen in this tick
  FaultSet safe_causes;    ///< what latched SAFE
  int mode_set = 0;        ///< which switches are commanded: 0 all of them, k + 1 the k-th set of those that are left
  int failed_switch = -1;  ///< the switch that was found to have failed, from then on; -1: none
  SwitchFaultKind failed_as = SwitchFaultKind::none;
};

/// A controller turns measurements into a command once a tick. step, applied, restart: no allocation, lock or exception.
class Controller {
 public:
  virtual ~Controller() = default;
  /// Decides what to command in this tick. It is called once a tick; ticks that were missed show in its time_s.
  virtual Decision step(const Measurement& measured) noexcept = 0;
  /// Tells which command left through the exit in the tick just stepped; a controller that is not told takes its own.
  virtual void applied(const Command& /*command*/) noexcept {}
  /// Begins the task anew at `time_s` from these values of the axes, without a jump of the reference.
  virtual void restart(double /*time_s*/, const AxisValues& /*from*/) noexcept {}
  /// The modes of the switches that are left, from the tick on in which one was found to have failed; until then nullptr. It
  /// lives as long as the controller.
  virtual const ModeSet* left() const noexcept { return nullptr; }
  /// Whether a switch is suspected, or was only just found to have failed: what channels show is then at odds with what the
  /// switches should do, and no channel is to be blamed for it.
  virtual bool doubts_switches() const noexcept { return false; }
};

}  // namespace solenoid
