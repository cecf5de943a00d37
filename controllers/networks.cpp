#include "controllers/networks.hpp"

#include "controllers/factory.hpp"
#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "core/config/whole_file.hpp"

#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// What there is, by name or path. Parsing takes milliseconds, so every text is parsed once.
struct Networks {
  struct Entry {
    std::string text;
    std::shared_ptr<const Mlp> network;
  };
  std::mutex mutex;
  std::map<std::string, Entry, std::less<>> known;
  std::string_view (*shipped)(std::string_view name) = nullptr;
};

Networks& networks() {
  static Networks all;
  return all;
}

std::shared_ptr<const Mlp> take_in(Networks& all, const std::string& name, const std::string& text) {
  Networks::Entry& entry = all.known[name];
  if (!entry.network || entry.text != text) entry = {text, std::make_shared<const Mlp>(read_mlp(text, name))};
  return entry.network;
}

}  // namespace

void ship_networks(std::string_view (*text_of)(std::string_view name)) noexcept {
  if (!networks().shipped) networks().shipped = text_of;
}

bool is_network_file(std::string_view network) { return network.ends_with(".toml"); }

void take_in_network(const std::string& path, const std::string& text) {
  const std::lock_guard lock(networks().mutex);
  take_in(networks(), path, text);
}

void take_in_network_file(const std::string& network) {
  if (!is_network_file(network)) return;
  const std::optional<std::string> text = read_whole_file(network, file_size::configuration);
  if (!text) throw ConfigError(fmt::format("{} cannot be read (allowed: a network's file)", network));
  take_in_network(network, *text);
}

std::shared_ptr<const Mlp> find_network(const std::string& network) {
  Networks& all = networks();
  const std::lock_guard lock(all.mutex);
  if (const auto known = all.known.find(network); known != all.known.end() && known->second.network)
    return known->second.network;
  if (const std::string_view text = all.shipped ? all.shipped(network) : std::string_view(); !text.empty())
    return take_in(all, network, std::string(text));
  throw ConfigError(
      fmt::format("'{}' is no network (allowed: a shipped one's name, or a file NAME.toml, as `solenoid "
                  "learn` writes them)",
                  network));
}

void check_network(TableReader& table, const VariantConfig& v) {
  if (v.learned.network.empty()) return;
  TableReader own = table.table("learned");
  if (is_network_file(v.learned.network)) {
    const LinkedFile file = own.file("network");
    if (!file.text) own.fail("network", fmt::format("{} cannot be read (allowed: a network's file)", file.path));
    take_in_network(file.path, *file.text);
  }
  try {
    const ReadySolver ready = ready_solver(v, *system_of(v).problem(v));
    if (!ready.solver) own.fail("network", fmt::format("'{}' {}", v.learned.network, ready.misfit));
  } catch (const ConfigError& wrong) {
    own.fail("network", wrong.what());
  }
}

}  // namespace solenoid
