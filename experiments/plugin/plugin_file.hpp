#pragma once

#include "core/config/reader.hpp"

#include <string>
#include <string_view>

namespace solenoid {

/// A plug-in is refused.
class PluginError : public ConfigError {
 public:
  using ConfigError::ConfigError;
};

/// What a plug-in's file says of itself, read without running any of it.
struct PluginRecord {
  std::string name;
  std::string abi;  ///< version, public headers and compiler that it was made with
};

/// Finds the record in a file's bytes; `file` is its name in errors. Throws PluginError where there is none, or none that
/// can be read.
PluginRecord parse_plugin(std::string_view bytes, const std::string& file);

/// Throws PluginError where a plug-in was not made for this program.
void require_same_abi(const PluginRecord& record, const std::string& file);

}  // namespace solenoid
