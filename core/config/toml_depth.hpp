#pragma once

#include <string>
#include <string_view>

namespace solenoid {

/// Throws ConfigError with file and line for TOML that has keys of more than 32 parts: each part is a table in a table,
/// and the parser, whose own bound is of brackets alone, would make as many as the file has room for.
void require_short_keys(std::string_view text, const std::string& name);

}  // namespace solenoid
