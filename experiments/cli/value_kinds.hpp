#pragma once

#include <string>
#include <vector>

namespace solenoid {

/// What the value of an option is, as help, manual page and completion name it: `->type_name(value_kind::variant)`.
namespace value_kind {
inline constexpr const char* variant = "VARIANT";
inline constexpr const char* scenario = "SCENARIO";
inline constexpr const char* campaign = "CAMPAIGN";
inline constexpr const char* campaign_or_log = "CAMPAIGN|LOG";
inline constexpr const char* parameter_set = "PARAMETERS";
inline constexpr const char* model = "PARAMETERS|FILE";
inline constexpr const char* table = "TABLE";
inline constexpr const char* file = "FILE";
inline constexpr const char* folder = "FOLDER";
inline constexpr const char* toml = "FILE.toml";
inline constexpr const char* log = "FILE.mcap";
inline constexpr const char* csv = "FILE.csv";
inline constexpr const char* html = "FILE.html";
inline constexpr const char* svg = "FILE.svg";
inline constexpr const char* png = "FILE.png";
}  // namespace value_kind

/// What there is to choose from for a kind.
struct ValueChoice {
  std::vector<std::string> names = {};    ///< those the program knows
  std::vector<std::string> endings = {};  ///< files that will do end in one of these; "" is every file
  bool folders = false;                   ///< a folder will do
};

/// Variants and scenarios are those of `campaign`, a shipped one or a file, if there is such; of all shipped ones
/// otherwise. Nothing to choose from for a kind that is not one of value_kind.
ValueChoice value_choice(const std::string& kind, const std::string& campaign = "");

}  // namespace solenoid
