#include "experiments/plugin/load_plugin.hpp"

#include "core/config/one_line.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/processes.hpp"
#include "experiments/plugin/plugin.hpp"
#include "experiments/plugin/python_rows.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <memory>
#include <regex>
#include <utility>

#include <cxxabi.h>
#include <dlfcn.h>
#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double most_s = 20.0;  // of loading

std::vector<LoadedPlugin>& all_plugins() {
  static std::vector<LoadedPlugin> all;
  return all;
}

/// What the loader says, its symbols as people write them.
std::string loader_problem() {
  const char* said = dlerror();
  std::string text = said ? said : "cannot be loaded";
  const std::size_t colon = text.find(": undefined symbol: ");
  if (colon == std::string::npos) return text;
  const std::string symbol = text.substr(text.rfind(' ') + 1);
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> plain(
      abi::__cxa_demangle(symbol.c_str(), nullptr, nullptr, &status), &std::free);
  return fmt::format("needs {}, which is not there", plain ? plain.get() : symbol.c_str());
}

/// Throws ConfigError or what the plug-in throws. It is never unloaded: what it registered stays.
void register_from(const std::string& path, Registry& registry) {
  void* plugin = dlopen(std::filesystem::absolute(path).c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!plugin) throw PluginError(fmt::format("{}: {} (allowed: a plug-in that can be loaded)", path, loader_problem()));
  const auto entry = reinterpret_cast<void (*)(Registry&)>(dlsym(plugin, "solenoid_plugin_register"));
  if (!entry) throw PluginError(fmt::format("{}: {} (allowed: a plug-in)", path, loader_problem()));
  try {
    entry(registry);
  } catch (const std::exception& error) {
    throw PluginError(
        fmt::format("{}: refuses to be loaded: {} (allowed: a plug-in that registers)", path, one_line(error.what())));
  }
}

/// Systems and their rows, as LoadedPlugin::adds has them.
std::set<std::string> names_of_systems() {
  std::set<std::string> names;
  for (const System* system : systems()) {
    names.insert(system->name());
    const auto take = [&](const std::string& row) { names.insert(system->name() + "/" + row); };
    std::ranges::for_each(system->solvers(), take, &SolverRow::name);
    std::ranges::for_each(system->laws(), take, &LawRow::name);
    std::ranges::for_each(system->estimators(), take, &EstimatorName::name);
    std::ranges::for_each(system->mode_sets(), take);
  }
  return names;
}

/// A process of its own takes what loading may do to a program.
void try_out(const std::string& path, Registry& registry) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(most_s);
  std::string problem;
  PoolEvents events;
  events.ended = [&](std::size_t, const Outcome& outcome) {
    if (!outcome.done) problem = outcome.text;
  };
  events.interrupted = [&] { return std::chrono::steady_clock::now() > end; };
  constexpr std::array<std::size_t, 1> once = {0};
  const bool ended = work_in_processes(
      once, 1,
      [&](std::size_t) {
        register_from(path, registry);
        return std::string();
      },
      events);
  if (!ended) problem = fmt::format("{}: not loaded within {:g} s (allowed: less)", path, most_s);
  if (problem.empty()) return;
  throw PluginError(problem.starts_with(path) ? problem
                                              : fmt::format("{}: fails while it is loaded: {} (allowed: a plug-in that "
                                                            "registers)",
                                                            path, one_line(problem)));
}

}  // namespace

void load_plugin(const std::string& path, Registry& registry) {
  const auto bytes = read_whole_file(path, file_size::plugin);
  if (!bytes) throw PluginError(fmt::format("{}: cannot be read (allowed: a plug-in)", path));
  const std::string print = fingerprint(*bytes);
  if (std::ranges::count(all_plugins(), print, &LoadedPlugin::fingerprint) > 0) return;
  const PluginRecord record = parse_plugin(*bytes, path);
  require_same_abi(record, path);
  for (const LoadedPlugin& other : all_plugins())
    if (other.name == record.name)
      throw PluginError(fmt::format("{}: plug-in '{}' is loaded from {} already (allowed: one of a name)", path,
                                    record.name, other.path));
  if (record.name == python_plugin)
    throw PluginError(
        fmt::format("{}: plug-in '{}' is the Python package's (allowed: another name)", path, record.name));
  try_out(path, registry);
  LoadedPlugin plugin{record.name, path, print};
  const std::set<std::string> before = names_of_systems();
  register_from(path, registry);
  std::ranges::set_difference(names_of_systems(), before, std::inserter(plugin.adds, plugin.adds.end()));
  all_plugins().push_back(std::move(plugin));
}

void note_plugin(LoadedPlugin plugin) {
  const auto known = std::ranges::find(all_plugins(), plugin.name, &LoadedPlugin::name);
  if (known == all_plugins().end())
    all_plugins().push_back(std::move(plugin));
  else
    known->adds.merge(plugin.adds);
}

bool LoadedPlugin::serves(const VariantConfig& v) const {
  const std::string& system = system_of(v).name();
  if (adds.contains(system)) return true;
  return std::ranges::any_of(std::array{v.solver, v.estimator, v.modes},
                             [&](const std::string& row) { return adds.contains(system + "/" + row); });
}

const std::vector<LoadedPlugin>& loaded_plugins() { return all_plugins(); }

}  // namespace solenoid
