#include "controllers/systems.hpp"

#include "core/systems/actuator/signals.hpp"

#include <algorithm>
#include <array>

namespace solenoid {

std::span<const SystemDescription* const> systems() {
  static const std::array all = {
      &actuator_description(),
  };
  return all;
}

const SystemDescription* find_system(std::string_view name) {
  const auto found = std::ranges::find(systems(), name, &SystemDescription::name);
  return found == systems().end() ? nullptr : *found;
}

}  // namespace solenoid
