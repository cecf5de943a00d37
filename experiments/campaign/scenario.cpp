#include "experiments/campaign/scenario.hpp"

#include "core/config/reader.hpp"
#include "experiments/campaign/simulated_system.hpp"

#include <fmt/format.h>

namespace solenoid {

const System& system_of(const ScenarioConfig& scenario) {
  return scenario.system ? *scenario.system : *systems().front();
}

ScenarioConfig read_scenario(TableReader& table) {
  ScenarioConfig s;
  s.name = table.text("name");
  s.system = &read_system(table);
  simulation_of(s).read(table, s);
  s.duration_s = table.number_or("duration_s", s.duration_s, {0.0, longest_motion_s, true});
  if (!(s.duration_s > 0)) table.fail("duration_s", "missing for a motion that never moves (allowed: above 0 s)");
  if (table.has("timing")) {
    TableReader timing = table.table("timing");
    s.timing = read_timing_keys(timing);
    with_keys(s.system->description().timing, s.timing, table.where("timing"));
  }
  table.finish();
  return s;
}

void read_motion(TableReader& trajectory, const SystemDescription& system, const AxisValues& starts,
                 ScenarioConfig& s) {
  if (system.axes.size() == 1) {
    s.trajectory = read_trajectory(trajectory, starts[0], system.axes[0].signal.unit);
    s.trajectory_kind = trajectory.text("kind");
    s.duration_s = s.trajectory.duration_s();
    return;
  }
  std::vector<Trajectory> axes;
  for (std::size_t a = 0; a < system.axes.size(); ++a) {
    axes.emplace_back(starts[a]);
    const std::string& name = system.axes[a].signal.name;
    if (!trajectory.has(name)) continue;
    TableReader own = trajectory.table(name);
    axes.back() = read_trajectory(own, starts[a], system.axes[a].signal.unit);
    const std::string kind = own.text("kind");
    if (s.trajectory_kind.find(kind) == std::string::npos)
      s.trajectory_kind += (s.trajectory_kind.empty() ? "" : "+") + kind;
  }
  trajectory.finish();
  if (s.trajectory_kind.empty()) s.trajectory_kind = "rest";
  s.trajectory = Motion(std::move(axes));
  s.duration_s = s.trajectory.duration_s();
}

std::string read_sensing(TableReader& table, ScenarioConfig& s, const std::vector<std::string>& own) {
  std::vector<std::string> allowed = {"ideal", "measured"};
  allowed.insert(allowed.end(), own.begin(), own.end());
  s.noise = table.boolean_or("noise", false);
  std::string sensing = table.text_or("sensing", s.noise ? "measured" : "ideal", allowed);
  s.ideal_sensing = sensing == "ideal";
  if (s.noise && s.ideal_sensing) table.fail("sensing", "'ideal' has no noise (allowed: measured, or noise = false)");
  return sensing;
}

void require_one_system(const VariantConfig& variant, const ScenarioConfig& scenario, const std::string& where) {
  if (&system_of(variant) != &system_of(scenario))
    throw ConfigError(
        fmt::format("{}: key 'system': scenario '{}' is of {}, variant '{}' of {} (allowed: scenarios and variants of "
                    "one system)",
                    where, scenario.name, system_of(scenario).name(), variant.name, system_of(variant).name()));
}

VariantConfig told(VariantConfig variant, const ScenarioConfig& scenario, const std::string& where) {
  require_one_system(variant, scenario, where);
  variant = timed(std::move(variant), scenario.timing, where);
  system_of(variant).tell(variant, scenario.setting);
  return variant;
}

VariantConfig told(VariantConfig variant, const ScenarioConfig& scenario) {
  return told(std::move(variant), scenario, scenario.name);
}

}  // namespace solenoid
