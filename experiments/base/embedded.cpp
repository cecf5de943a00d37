#include "experiments/base/embedded.hpp"

#include "controllers/networks.hpp"
#include "core/config/reader.hpp"

#include <map>

namespace solenoid {

// Generated of the files (cmake/EmbedText.cmake).
std::string_view built_in_text(std::string_view name);
const std::vector<std::string>& built_in_names();

namespace {

struct Embedded {
  std::vector<std::string> names = built_in_names();
  std::map<std::string, std::string, std::less<>> added;
};

Embedded& embedded() {
  static Embedded all;
  return all;
}

/// Networks are text that only controllers read.
std::string_view network_text(std::string_view name) {
  return embedded_text("networks/" + std::string(name) + ".toml");
}
[[maybe_unused]] const bool told_of_networks = (ship_networks(network_text), true);

}  // namespace

std::string_view embedded_text(std::string_view name) {
  const auto added = embedded().added.find(name);
  return added == embedded().added.end() ? built_in_text(name) : added->second;
}

const std::vector<std::string>& embedded_names() { return embedded().names; }

void embed_text(const std::string& name, std::string text) {
  if (!embedded_text(name).empty()) throw ConfigError(name + ": is shipped already (allowed: another name)");
  embedded().added.emplace(name, std::move(text));
  embedded().names.push_back(name);
}

}  // namespace solenoid
