#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace solenoid {

/// Bounds of a JSON text: what lies within is parsed, copied and printed in little time, memory and stack.
namespace json_bounds {
inline constexpr int depth = 64;
inline constexpr int values = 2'000'000;
inline constexpr long long key_look_ups = 100'000'000;  ///< objects keep their order, and look for a key one by one
}  // namespace json_bounds

/// Parses JSON that may come from anywhere: every reader's one way. Throws ConfigError with the file's name, the line and
/// what is allowed; no other exception.
nlohmann::ordered_json parse_json(std::string_view text, const std::string& name,
                                  const std::string& allowed = "JSON, at most 64 levels deep");

/// What JSON says about a value that is not as asked for, without the library's own names.
std::string problem_with_json(const nlohmann::ordered_json::exception& error);

}  // namespace solenoid
