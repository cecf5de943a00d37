#pragma once

#include "controllers/own_settings.hpp"
#include "controllers/systems.hpp"
#include "core/reference/motion.hpp"

#include <string>

namespace solenoid {

/// A task and the plant it is done on, as data: one [[scenario]] table.
struct ScenarioConfig {
  std::string name;
  const System* system = nullptr;  ///< whose task it is; null: the first's
  std::string trajectory_kind;
  Motion trajectory{Trajectory(0.0)};
  TimingKeys timing;  ///< in place of the system's
  double duration_s = 8.0;
  bool noise = false;         ///< the run depends on its seed
  bool ideal_sensing = true;  ///< controllers read the true state
  std::string setting;        ///< what the task tells its controllers (System::tell)
  OwnSettings own;            ///< what the system alone knows: its plant
};

/// Whose task a scenario is.
const System& system_of(const ScenarioConfig& scenario);

/// Reads one scenario. Throws ConfigError with file, line, key and what is allowed.
ScenarioConfig read_scenario(TableReader& table);

/// Reads the motion of a system's axes from a table: of one axis itself, of several a table each by their names, an axis
/// that is not there resting at its start. Fills trajectory, its kind and the duration.
void read_motion(TableReader& trajectory, const SystemDescription& system, const AxisValues& starts,
                 ScenarioConfig& scenario);

/// Reads whether channels are noisy, `noise`, and whether controllers read the true state, `sensing`: "ideal", which has
/// no noise, "measured", or another of the system's `own`. Returns `sensing`.
std::string read_sensing(TableReader& table, ScenarioConfig& scenario, const std::vector<std::string>& own = {});

/// Throws ConfigError, `where` being what is refused, for a variant of another system.
void require_one_system(const VariantConfig& variant, const ScenarioConfig& scenario, const std::string& where);

/// The variant as it runs in the scenario: sampling, and what the task tells it. Throws ConfigError if they are of two
/// systems or, `where` being the scenario's timing, that does not fit.
VariantConfig told(VariantConfig variant, const ScenarioConfig& scenario, const std::string& where);
/// The same, called by the scenario's name.
VariantConfig told(VariantConfig variant, const ScenarioConfig& scenario);

}  // namespace solenoid
