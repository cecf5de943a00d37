#include "controllers/systems.hpp"

#include "controllers/registered_systems.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {

#define SOLENOID_DECLARE(name) System& name##_system();
SOLENOID_SYSTEMS(SOLENOID_DECLARE)
#undef SOLENOID_DECLARE

namespace {

std::vector<System*>& registered_systems() {
#define SOLENOID_LISTED(name) &name##_system(),
  static std::vector<System*> all = {SOLENOID_SYSTEMS(SOLENOID_LISTED)};
#undef SOLENOID_LISTED
  return all;
}

}  // namespace

std::span<const System* const> systems() { return registered_systems(); }

void register_system(System& system) {
  if (find_system(system.name()))
    throw ConfigError(
        fmt::format("system '{}' is there twice (allowed: names other than {})", system.name(), system_names()));
  registered_systems().push_back(&system);
}

System& system_to_extend(std::string_view name) {
  for (System* system : registered_systems())
    if (system->name() == name) return *system;
  throw ConfigError(fmt::format("system '{}' is not known (allowed: {})", name, system_names()));
}

const System* find_system(std::string_view name) {
  const auto found = std::ranges::find(systems(), name, &System::name);
  return found == systems().end() ? nullptr : *found;
}

std::string system_names() {
  std::vector<std::string> names;
  for (const System* system : systems()) names.push_back(system->name());
  return fmt::format("{}", fmt::join(names, ", "));
}

const System& system_of(const VariantConfig& variant) { return variant.system ? *variant.system : *systems().front(); }

const System& read_system(TableReader& table) {
  const std::string name = table.text_or("system", systems().front()->name());
  if (const System* system = find_system(name)) return *system;
  table.fail("system", fmt::format("'{}' is not known (allowed: {})", name, system_names()));
}

}  // namespace solenoid
