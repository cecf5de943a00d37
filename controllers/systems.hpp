#pragma once

#include "core/system/description.hpp"

#include <span>
#include <string_view>

namespace solenoid {

/// The systems there are, in the order of listings; the first is what a file means that names none.
std::span<const SystemDescription* const> systems();

/// The system of this name, or null.
const SystemDescription* find_system(std::string_view name);

}  // namespace solenoid
