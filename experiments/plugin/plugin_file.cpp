#include "experiments/plugin/plugin_file.hpp"

#include "experiments/plugin/abi.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace solenoid {
namespace {

// In two parts, so that the program's own bytes hold no such record.
constexpr std::array<std::string_view, 2> magic = {"SOLENOID PLUG-IN", "\nname="};
constexpr std::string_view abi_key = "\nabi=", end = "\n\n";
constexpr std::size_t most_name = 80, most_abi = 200;
constexpr std::string_view elf =
    "\x7f"
    "ELF";

bool printable(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; });
}

/// The text from `at` to before `until`, which lies at most `most` further; `at` is then behind that. Nothing if not.
std::string_view take(std::string_view bytes, std::size_t& at, std::string_view until, std::size_t most) {
  const std::string_view within = bytes.substr(at, most + until.size());
  const std::size_t size = within.find(until);
  if (size == std::string_view::npos) return {};
  at += size + until.size();
  return within.substr(0, size);
}

}  // namespace

PluginRecord parse_plugin(std::string_view bytes, const std::string& file) {
  const auto refuse = [&](const std::string& what) {
    return PluginError(
        fmt::format("{}: {} (allowed: a shared object with SOLENOID_PLUGIN in one of its files)", file, what));
  };
  if (!bytes.starts_with(elf)) throw refuse("no shared object");
  for (std::size_t at = 0; (at = bytes.find(magic[0], at)) != std::string_view::npos;) {
    at += magic[0].size();
    if (!bytes.substr(at).starts_with(magic[1])) continue;
    at += magic[1].size();
    const std::string_view name = take(bytes, at, abi_key, most_name), abi = take(bytes, at, end, most_abi);
    if (!printable(name) || !printable(abi)) throw refuse("a damaged record of a plug-in");
    return {std::string(name), std::string(abi)};
  }
  throw refuse("no plug-in");
}

void require_same_abi(const PluginRecord& record, const std::string& file) {
  if (record.abi != SOLENOID_ABI)
    throw PluginError(fmt::format("{}: plug-in '{}' was made with solenoid {} (allowed: {}; build it again)", file,
                                  record.name, record.abi, SOLENOID_ABI));
}

}  // namespace solenoid
