#pragma once

#include "controllers/systems.hpp"
#include "experiments/plugin/abi.hpp"

#include <string>
#include <string_view>

/// A plug-in: a shared object that adds systems, solvers, laws, estimators and mode sets to the program or the Python
/// package that loads it. One file of it has
///
///     SOLENOID_PLUGIN("my_tank", registry) {
///       registry.add(my_tank_system(), my_tank_simulation());
///       registry.add_campaign("my_tank", my_tank_campaign);
///       registry.system("thrusters").add(LawRow{...});
///     }
///
/// It is not linked against the library: whoever loads it has that, in the one version that the plug-in was made with.

namespace solenoid {

class SimulatedSystem;
struct ModelDescription;

/// Where a plug-in says what it adds. All functions throw where there is one of the name.
class Registry {
 public:
  virtual ~Registry() = default;
  /// A system and how it is simulated; both have to outlive everything.
  virtual void add(System& system, const SimulatedSystem& simulation) = 0;
  /// A system that is a model and what is said of it (experiments/described/described.hpp).
  template <HybridModel M>
  void add(ModelDescription said);
  /// A campaign of this name, TOML, as shipped ones are: its variants are known everywhere. That of a system's name has
  /// the task that `run` and the studies take.
  virtual void add_campaign(const std::string& name, std::string toml) = 0;
  /// A system that is there, to add rows to.
  System& system(std::string_view name) { return system_to_extend(name); }
};

}  // namespace solenoid

/// What a file says before anything of it is run (plugin_file.hpp).
#define SOLENOID_PLUGIN_RECORD(name) "SOLENOID PLUG-IN\nname=" name "\nabi=" SOLENOID_ABI "\n\n"
// NOLINTBEGIN(bugprone-macro-parentheses): the name of a parameter
#define SOLENOID_PLUGIN(name, registry)                                                                    \
  extern "C" [[gnu::used, gnu::visibility("default")]] const char solenoid_plugin_record[] =               \
      SOLENOID_PLUGIN_RECORD(name);                                                                        \
  extern "C" [[gnu::visibility("default")]] void solenoid_plugin_register(::solenoid::Registry& registry); \
  void solenoid_plugin_register(::solenoid::Registry& registry)
// NOLINTEND(bugprone-macro-parentheses)
