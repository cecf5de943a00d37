#include "experiments/systems/actuator/plants/plant_config.hpp"

#include "core/config/reader.hpp"
#include "experiments/systems/actuator/twin/twin_sensing.hpp"

#include <cmath>

#include <fmt/format.h>

namespace solenoid {

PlantConfig read_plant_config(TableReader& table) {
  PlantConfig p;
  p.plane = table.text_or("plane", "vertical", {"vertical", "horizontal"}) == "vertical" ? Plane::vertical
                                                                                         : Plane::horizontal;
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
  p.noise = table.boolean_or("noise", false);
  if (table.has("noise_factor")) {
    if (p.plant != "twin") table.fail("noise_factor", "only the twin's sensors have it (allowed: plant = \"twin\")");
    p.twin.sensing.scale_noise(table.number("noise_factor", Range::between(0.0, 10.0)));
  }
  const std::string sensing = table.text_or("sensing", p.noise ? "measured" : "ideal", {"ideal", "measured", "chain"});
  p.ideal_sensing = sensing == "ideal";
  p.sensing_chain = sensing == "chain";
  if (p.noise && p.ideal_sensing) table.fail("sensing", "'ideal' has no noise (allowed: measured, or noise = false)");
  if (table.has("kick")) {
    TableReader kick = table.table("kick");
    p.kick = {kick.number("at_s", Range::non_negative()), kick.number("speed_m_s", Range::between(-5.0, 5.0))};
    kick.finish();
    if (p.plant != "model") table.fail("kick", "the twin takes none (allowed: plant = \"model\")");
  }
  return p;
}

void check_tick(const PlantConfig& config, double tick_s, const std::string& where) {
  const double intervals = tick_s / SensingChain::interval_s;
  if (config.plant == "twin" && std::abs(intervals - std::round(intervals)) > 1e-6)
    throw ConfigError(
        fmt::format("{}: key 'timing': ticks of {:g} ms with plant = \"twin\" (allowed: multiples of {:g} ms)", where,
                    1e3 * tick_s, 1e3 * SensingChain::interval_s));
}

}  // namespace solenoid
