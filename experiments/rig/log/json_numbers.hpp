#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace solenoid {

/// Reads the numbers of one JSON object without building it: `take(path, value)` for each, in order. Of a number in an
/// object below, or in a list, the path is dotted: "pose.position.x", "joints.0". True and false are 1 and 0, null is
/// NaN; texts are passed over.
///
/// Returns what is wrong with the text, in words without its source; nothing if it is such an object. Objects and lists
/// may be nested 16 deep.
std::optional<std::string> read_json_numbers(std::string_view json,
                                             const std::function<void(const std::string& path, double value)>& take);

}  // namespace solenoid
