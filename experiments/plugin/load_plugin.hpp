#pragma once

#include "experiments/plugin/plugin_file.hpp"

#include <set>
#include <string>
#include <vector>

namespace solenoid {

class Registry;
struct VariantConfig;

/// A plug-in that was loaded.
struct LoadedPlugin {
  std::string name;
  std::string path;         ///< as it was named
  std::string fingerprint;  ///< of the file's content
  /// What it added: systems as "NAME", rows of systems as "SYSTEM/ROW".
  std::set<std::string> adds{};

  /// Whether a variant has something of it.
  bool serves(const VariantConfig& variant) const;
};

/// Loads a plug-in and has it register what it adds there. One that has been loaded, the same file or a copy of it, is left
/// alone. Throws PluginError, one line with the file, where it is not made for this program, lacks a symbol, refuses, or
/// crashes or hangs while it is loaded, which is tried in a process of its own first.
void load_plugin(const std::string& path, Registry& registry);

/// Notes one that is part of the program; of one that is there, what it added since.
void note_plugin(LoadedPlugin plugin);

/// Those that were loaded, in order.
const std::vector<LoadedPlugin>& loaded_plugins();

}  // namespace solenoid
