#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace solenoid {

/// What is wrong with this value of a log's number, called as we call it, in SI units: "position_m 50 m (allowed: ...)".
/// Nothing if an actuator may have it, or if the number has no bounds here.
std::optional<std::string> implausible(std::string_view name, double value);

}  // namespace solenoid
