#pragma once

#include "controllers/system.hpp"

#include <span>
#include <string_view>

namespace solenoid {

/// The systems there are, in the order of listings; the first is what a file means that names none.
std::span<const System* const> systems();

/// Adds one behind them, which has to outlive everything. Throws ConfigError if there is one of its name.
void register_system(System& system);
/// The system of this name, to add rows to. Throws ConfigError.
System& system_to_extend(std::string_view name);

/// The system of this name, or null.
const System* find_system(std::string_view name);

/// The names, for messages.
std::string system_names();

/// Whose controller a variant is.
const System& system_of(const VariantConfig& variant);

/// Reads the key `system` of a variant or scenario. Throws ConfigError.
const System& read_system(TableReader& table);

}  // namespace solenoid
