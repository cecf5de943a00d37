#include "experiments/systems/actuator/force_ratio/force_ratio_plants.hpp"

#include "core/systems/actuator/parameters.hpp"
#include "experiments/base/embedded.hpp"
#include "experiments/base/files.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// What is left of the cylinder in the model of a motor alone, whose valves stay closed: of the thesis's piston area.
constexpr double vestige = 2e-3;

Document shipped(const char* name) { return Document::from_text(std::string(embedded_text(name)), name); }
const Document& shipped_twin() {
  static const Document document = shipped("scenarios/twin.toml");
  return document;
}
const Document& shipped_plants() {
  static const Document document = shipped("tasks/force_ratio_plants.toml");
  return document;
}

/// The actuator's keys that a ratio changes. Valves are as large as the piston, so that chambers fill as fast at every
/// ratio, and the rod keeps its part of the bore.
toml::table scaled_actuator(const RatioDesign& design) {
  toml::table actuator = *shipped_twin().root()["actuator"].as_table();
  const ActuatorParameters rig;
  const double bore = design.has_cylinder() ? design.bore_m : std::sqrt(vestige) * rig.bore_diameter_m;
  const double scale = bore / rig.bore_diameter_m, area = scale * scale;
  const double pinion = design.has_motor() ? design.pinion_m : rig.pinion_pitch_diameter_m;
  const double gain = design.motor_n * pinion / 2 / (rig.motor_torque_constant * rig.amplifier_limit_v);
  const auto flow = [&](const char* key, double rigs) { return area * actuator[key].value_or(rigs); };
  for (const auto& [key, value] : {std::pair{"bore_diameter_m", bore},
                                   {"rod_diameter_m", scale * rig.rod_diameter_m},
                                   {"fill_coefficient", flow("fill_coefficient", rig.fill_coefficient)},
                                   {"discharge_coefficient", flow("discharge_coefficient", rig.discharge_coefficient)},
                                   {"choked_flow", flow("choked_flow", rig.choked_flow)},
                                   {"pinion_pitch_diameter_m", pinion},
                                   {"amplifier_gain", gain}})
    actuator.insert_or_assign(key, value);
  return actuator;
}

/// Half the way in a second or so.
toml::table quick_trajectory(const std::string& kind) {
  if (kind == "cycloidal") return toml::table{{"kind", kind}, {"to_m", 0.06}, {"move_s", 0.6}, {"dwell_s", 0.2}};
  return toml::table{{"kind", kind}, {"to_m", 0.06}, {"frequency_hz", 1.0}, {"periods", 1}, {"lead_s", 0.4}};
}

std::string share_of(const RatioDesign& design) { return fmt::format("share {:.3g}", design.share); }

}  // namespace

Document twin_of(const RatioDesign& design) {
  Document twin = shipped_twin();
  twin.root().insert_or_assign("actuator", scaled_actuator(design));
  toml::table& gear = *twin.root()["gear"].as_table();
  if (design.has_motor())
    gear.insert_or_assign("rotor_inertia", design.motor_inertia);
  else
    gear.insert_or_assign("law", "rigid");
  twin.set_by("actuator", share_of(design));
  twin.set_by(design.has_motor() ? "gear.rotor_inertia" : "gear.law", share_of(design));
  return twin;
}

Document controller_of(const std::string& law, const RatioDesign& design) {
  const std::string path = "variant." + law;
  Document controller = shipped_plants().part(path, *shipped_plants().root()["variant"][law].as_table());
  // The model is the nominal twin's parameters, the rotor's inertia in the mass, as identifying gives.
  toml::table model = scaled_actuator(design);
  const double radius = design.pinion_m / 2;
  const double rotor = design.has_motor() ? design.motor_inertia / (radius * radius) : 0.0;
  model.insert_or_assign("inferred_equivalent_mass_kg", model["inferred_equivalent_mass_kg"].value_or(0.0) + rotor);
  controller.root().insert_or_assign("model", std::move(model));
  controller.set_by(path + ".model", share_of(design));
  return controller;
}

Document ratio_campaign(const std::string& folder, const std::string& name, const std::string& variant,
                        const Document& controller, const Document& twin, const RatioPlants& plants) {
  Document campaign(fmt::format("{}/{}.toml", folder, name));
  toml::table& root = campaign.root();
  root = toml::table{{"variants", toml::array{variant}}, {"seeds", toml::array{1}}};
  root.insert("variant", toml::table{{variant, controller.root()}});
  campaign.comes_from("variant." + variant, controller, controller.path());
  toml::array scenarios;
  const toml::array& shipped = *shipped_plants().root()["scenario"].as_array();
  for (std::size_t i = 0; i < shipped.size(); ++i) {
    toml::table scenario = *shipped[i].as_table();
    const std::string plant = scenario["name"].value_or("");
    const auto begins = [&](const std::string& group) { return plant.starts_with(group); };
    if (std::ranges::none_of(plants.groups, begins)) continue;
    scenario.insert_or_assign("twin", "twin.toml");
    scenario["ensemble"].as_table()->insert_or_assign("members", plants.members);
    if (plants.quick)
      scenario.insert_or_assign("trajectory", quick_trajectory(scenario["trajectory"]["kind"].value_or("sine")));
    campaign.comes_from(fmt::format("scenario[{}]", scenarios.size()), shipped_plants(),
                        fmt::format("scenario[{}]", i));
    scenarios.push_back(std::move(scenario));
  }
  root.insert("scenario", std::move(scenarios));
  campaign.carry("twin.toml", toml_text(twin.root()) + "\n");
  write_file_atomically(folder + "/twin.toml", *campaign.linked("twin.toml"));
  write_file_atomically(campaign.name(), toml_text(root) + "\n");
  return campaign;
}

}  // namespace solenoid
