#pragma once

#include "controllers/variant.hpp"

#include <string>

namespace solenoid {

/// A variant of the shipped variants.toml. Throws ConfigError for an unknown name, with the allowed ones.
VariantConfig shipped_variant(const std::string& name);

}  // namespace solenoid
