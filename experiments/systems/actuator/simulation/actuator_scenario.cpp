#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"

#include "core/config/reader.hpp"

namespace solenoid {

void set_plane(ScenarioConfig& s, Plane plane) {
  actuator(s).plane = plane;
  s.setting = plane == Plane::vertical ? "vertical" : "horizontal";
}

void read_actuator_scenario(TableReader& table, ScenarioConfig& s) {
  ActuatorScenario& p = actuator(s);
  const std::string plane = table.text_or("plane", "vertical", {"vertical", "horizontal"});
  set_plane(s, plane == "vertical" ? Plane::vertical : Plane::horizontal);
  p.payload_kg = table.number_or("payload_kg", 0.0, Range::between(0.0, 10.0));
  p.plant = table.text_or("plant", p.plant, {"model", "twin"});
  if (p.plant == "twin" && table.has("twin")) {
    TableReader twin = table.file_table("twin");
    p.twin = read_twin(twin);
  }
  if (table.has("mismatch")) {
    TableReader mismatch = table.table("mismatch");
    p.mismatch = read_mismatch(mismatch);
  }
  if (table.has("noise_factor")) {
    if (p.plant != "twin") table.fail("noise_factor", "only the twin's sensors have it (allowed: plant = \"twin\")");
    p.twin.sensing.scale_noise(table.number("noise_factor", Range::between(0.0, 10.0)));
  }
  p.sensing_chain = read_sensing(table, s, {"chain"}) == "chain";
  if (table.has("kick")) {
    TableReader kick = table.table("kick");
    p.kick = {kick.number("at_s", Range::between(0.0, longest_motion_s)),
              kick.number("speed_m_s", Range::between(-5.0, 5.0))};
    kick.finish();
    if (p.plant != "model") table.fail("kick", "the twin takes none (allowed: plant = \"model\")");
  }
}

}  // namespace solenoid
