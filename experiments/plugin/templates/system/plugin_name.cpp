#include "plugin_name.hpp"

#include <solenoid/experiments/described/described.hpp>

namespace plugin_name {

/// All that is known of the system beside its model: docs/how-to/plug-ins.md says what else there is.
solenoid::ModelDescription description() {
  solenoid::ModelDescription d;
  d.name = "plugin_name";
  d.summary = "a plate with a heater that is on or off";
  d.states = {{.name = "plate", .unit = "degC", .start = 50.0, .low = -50.0, .high = 400.0},
              {.name = "block", .unit = "degC", .start = 40.0, .low = -50.0, .high = 400.0}};
  d.parameters = {{"power_w", 60.0, solenoid::Range::positive(), "W"},
                  {"air_c", 20.0, {-50.0, 50.0}, "degC"},
                  {"plate_j_per_k", 50.0, solenoid::Range::positive(), "J/K"},
                  {"block_j_per_k", 500.0, solenoid::Range::positive(), "J/K"},
                  {"inner_k_per_w", 0.5, solenoid::Range::positive(), "K/W"},
                  {"air_k_per_w", 2.0, solenoid::Range::positive(), "K/W"}};
  d.channels = {{.state = "plate", .sigma = 0.05}, {.state = "block", .sigma = 0.2}};
  d.outputs = {{.state = "plate", .weight = 1.0, .target = 60.0}};
  d.mode_sets = {{.name = "heater",
                  .switches = {{.name = "heater", .min_dwell_s = 2.0}},
                  .modes = {{"off", 0}, {"on", 1}},
                  .offset = {0.0},
                  .gain = {{1.0}}}};
  d.consumption = {"energy", "J", "energy_j", "energy"};
  d.timing = {0.2, 5};
  d.steps = 100;
  d.blocks = {2, 2, 2, 4, 4, 6};
  return d;
}

}  // namespace plugin_name

SOLENOID_COMPILE_MODEL(plugin_name::Plate)

extern const char plugin_name_toml[];

SOLENOID_PLUGIN("plugin_name", registry) {
  registry.add<plugin_name::Plate>(plugin_name::description());
  registry.add_campaign("plugin_name", plugin_name_toml);
}
