#include "controllers/registered_systems.hpp"
#include "experiments/campaign/simulated_system.hpp"

#include <stdexcept>
#include <vector>

#include <nlohmann/json.hpp>

namespace solenoid {

#define SOLENOID_DECLARE_SIMULATION(name) const SimulatedSystem& name##_simulation();
SOLENOID_SYSTEMS(SOLENOID_DECLARE_SIMULATION)
#undef SOLENOID_DECLARE_SIMULATION

namespace {

std::vector<const SimulatedSystem*>& simulations() {
#define SOLENOID_LISTED_SIMULATION(name) &name##_simulation(),
  static std::vector<const SimulatedSystem*> all = {SOLENOID_SYSTEMS(SOLENOID_LISTED_SIMULATION)};
#undef SOLENOID_LISTED_SIMULATION
  return all;
}

}  // namespace

void register_simulation(const SimulatedSystem& simulation) { simulations().push_back(&simulation); }

const SimulatedSystem& simulation_of(const System& system) {
  for (const SimulatedSystem* simulation : simulations())
    if (&simulation->system() == &system) return *simulation;
  throw std::invalid_argument("the system '" + system.name() + "' has no simulation");
}

std::vector<MotionKind> usual_motions(const SystemDescription& system) {
  const std::string& first = system.axes.front().signal.unit;
  const bool alike = std::ranges::all_of(system.axes, [&](const Axis& axis) { return axis.signal.unit == first; });
  const std::string unit = alike ? unit_in_keys(first) : "UNIT", from = "from_" + unit, to = "to_" + unit,
                    height = "height_" + unit;
  return {
      {"cycloidal", from + ", " + to + ", move_s, dwell_s", "dwell, one cycloid, dwell"},
      {"sine", from + ", " + to + ", frequency_hz, periods, lead_s",
       "a cycloid up, periods of a cosine, a cycloid back"},
      {"step", from + ", " + height + ", at_s, hold_s, steady_s", "a step, held"},
      {"multi_cycloid", from + ", " + to + " = [..], move_s, dwell_s", "cycloids from station to station, with dwells"},
      {"csv", "path", "points time_s,position_m of a file"}};
}

std::string script_name(const ActuationFault& fault, const Switch& of) {
  std::string name = fault.target + "_" + of.name;
  for (char& c : name) c = c == ' ' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name;
}

std::span<const ActuationFault> SimulatedSystem::actuation_faults() const {
  static const std::vector<ActuationFault> all = {{"switches", "stuck"}};
  return all;
}

Command SimulatedSystem::spoiled(const VariantConfig&, const ActuationFault&, const Command& wanted,
                                 const Command& last) const {
  Command reached = wanted;
  reached.switches = last.switches;
  return reached;
}

nlohmann::ordered_json SimulatedSystem::published(const VariantConfig&, const ScenarioConfig&) const { return {}; }

std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& variant, const ScenarioConfig& scenario,
                                           std::uint64_t seed) {
  return simulation_of(scenario).make_plant(told(variant, scenario), scenario, seed);
}

}  // namespace solenoid
