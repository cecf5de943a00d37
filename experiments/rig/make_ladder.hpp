#pragma once

#include "controllers/factory.hpp"
#include "controllers/ladder/fallback_ladder.hpp"

#include <memory>

namespace solenoid {

/// A variant's controller inside the fallback ladder, as the rig runs it. Throws ConfigError or std::invalid_argument.
std::unique_ptr<FallbackLadder> make_ladder(const VariantConfig& variant, const Trajectory& reference, Plane plane,
                                            const LadderSettings& settings, const SolverDecorator& decorate);

}  // namespace solenoid
