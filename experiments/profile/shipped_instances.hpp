#pragma once

#include <string_view>

namespace solenoid {

/// The file of instances inside the program.
std::string_view shipped_instance_bytes();
inline constexpr const char* shipped_instances_name = "closed_loops.instances";

}  // namespace solenoid
