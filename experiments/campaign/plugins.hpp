#pragma once

#include "experiments/plugin/load_plugin.hpp"
#include "experiments/plugin/plugin.hpp"

#include <string>

namespace solenoid {

/// Where what this process knows is added to: systems, their simulations, campaigns.
Registry& program_registry();

/// Loads a plug-in into this process (load_plugin.hpp). Throws PluginError.
void load_plugin(const std::string& path);

}  // namespace solenoid
