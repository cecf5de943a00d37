#include "controllers/systems.hpp"

#include "controllers/registered_systems.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {

#define SOLENOID_DECLARE(name) const System& name##_system();
SOLENOID_SYSTEMS(SOLENOID_DECLARE)
#undef SOLENOID_DECLARE

std::span<const System* const> systems() {
#define SOLENOID_LISTED(name) &name##_system(),
  static const std::array all = {SOLENOID_SYSTEMS(SOLENOID_LISTED)};
#undef SOLENOID_LISTED
  return all;
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
