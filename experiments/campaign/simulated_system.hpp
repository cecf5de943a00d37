#pragma once

#include "core/metrics/metrics.hpp"
#include "core/mpc/switch_fault.hpp"
#include "core/safety/plausibility.hpp"
#include "experiments/campaign/scenario.hpp"
#include "experiments/campaign/trace_layout.hpp"
#include "experiments/plants/simulated_plant.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace solenoid {

/// A number of a scenario that an ensemble draws (ensemble.hpp).
struct DrawnQuantity {
  std::string name;  ///< in the table `ensemble`
  std::string path;  ///< in the scenario's table: "mismatch.friction"
  Range range = {0.0, 10.0, true};
  bool logarithmic = true;  ///< uniform in its logarithm
  double usual = 1.0;       ///< where nothing is drawn
  bool optional = false;    ///< the scenario has the key only if it is drawn
};

/// Something between a command and what it switches that can fail by script.
struct ActuationFault {
  std::string target, kind;  ///< "supply", "lost"
  /// How a single switch fails, if that is what it is: the target is then what its switches are called ("coil"), and
  /// scripts add _ and the switch's name, in lower case with _ for spaces: "coil_supply_a".
  SwitchFaultKind of_switch = SwitchFaultKind::none;
  std::string unit = {};   ///< of its value; empty: it has none
  bool of_plant = false;   ///< SimulatedPlant::fail_part() has it, and no command shows it
  double most = 1.0;       ///< of a value of a plant's own fault, which is above 0
  std::string needs = {};  ///< mode sets that can have it, separated by spaces; empty: every one
};

/// A switch's name as scripts write it after what the system calls its switches: "coil_supply_a".
std::string script_name(const ActuationFault& fault, const Switch& of);

/// A motion that a scenario's table `trajectory` may be, for `list trajectories`.
struct MotionKind {
  std::string kind, keys, summary;
};

/// Those of a system that reads them by read_motion(): of several axes a table each, by their names.
std::vector<MotionKind> usual_motions(const SystemDescription& system);

/// How a system is simulated: what a scenario of it may say, the plant that becomes of it, and what a run is judged by. A
/// system derives from this and is registered (controllers/registered_systems.hpp).
///
/// const throughout: one object serves all scenarios.
class SimulatedSystem {
 public:
  virtual ~SimulatedSystem() = default;

  virtual const System& system() const = 0;
  /// Reads the system's own keys and the motion; leaves the others to whoever finishes the table. Throws ConfigError.
  virtual void read(TableReader& table, ScenarioConfig& scenario) const = 0;
  /// Throws ConfigError where a variant, told of the scenario, cannot run in it. where: a key's place.
  virtual void check(const ScenarioConfig& /*scenario*/, const VariantConfig& /*variant*/,
                     const std::function<std::string(const char* key)>& /*where*/) const {}
  /// What read() takes for a motion.
  virtual std::vector<MotionKind> motions() const { return usual_motions(system().description()); }
  /// What ensembles draw.
  virtual std::span<const DrawnQuantity> quantities() const { return {}; }
  /// The scenario's numbers in its runs' records, one for each of the description's `conditions`.
  virtual std::vector<double> conditions(const ScenarioConfig& /*scenario*/) const { return {}; }

  /// The plant with a variant's mode set, where the motion starts; the variant is told.
  virtual std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& variant, const ScenarioConfig& scenario,
                                                     std::uint64_t seed) const = 0;
  /// What noise and converters the scenario's plant has, one a channel; empty: what a rig of the system has.
  virtual std::vector<ChannelNoise> noise(const ScenarioConfig& /*scenario*/) const { return {}; }
  /// The shipped campaign that has its task for runs in real time: the first scenario of it.
  virtual std::string real_time_campaign() const { return system().name(); }
  /// What of its actuation can fail; spoiled() knows each.
  virtual std::span<const ActuationFault> actuation_faults() const;
  /// What reaches the plant of a command under such a fault; last: what reached it before.
  virtual Command spoiled(const VariantConfig& variant, const ActuationFault& fault, const Command& wanted,
                          const Command& last) const;

  /// A run's metrics: those of the description.
  virtual Metrics evaluate(const VariantConfig& variant, const ScenarioConfig& scenario,
                           std::span<const TickRecord> ticks, const Consumed& consumed) const = 0;
  /// What a publication prints for a run of this kind, for reports: members of the run's object, or null.
  virtual nlohmann::ordered_json published(const VariantConfig& variant, const ScenarioConfig& scenario) const;
  /// What of its runs is kept and drawn.
  virtual TraceLayout layout(const VariantConfig& /*variant*/, const ScenarioConfig& /*scenario*/) const {
    return described_layout(system().description());
  }
};

/// The scenario's plant with this variant's mode set, told of the scenario first.
std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& variant, const ScenarioConfig& scenario,
                                           std::uint64_t seed);

/// Adds how a system is simulated that has been registered; it has to outlive everything.
void register_simulation(const SimulatedSystem& simulation);
/// How a system is simulated.
const SimulatedSystem& simulation_of(const System& system);
/// The same of a scenario's system.
inline const SimulatedSystem& simulation_of(const ScenarioConfig& scenario) {
  return simulation_of(system_of(scenario));
}

}  // namespace solenoid
