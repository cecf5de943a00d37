#pragma once

#include "controllers/variant_keys.hpp"

#include <vector>

namespace solenoid {

/// The actuator's own keys of a variant.
std::vector<VariantKey> actuator_keys();

}  // namespace solenoid
