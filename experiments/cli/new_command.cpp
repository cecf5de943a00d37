#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/embedded.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/shown_text.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/value_kinds.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <memory>
#include <system_error>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view placeholder = "plugin_name";
constexpr const char* kinds[] = {"system", "controller", "solver"};

struct NewArguments {
  std::string kind, name, folder;
};

/// Whether a solver, a law, a group of keys or a shipped campaign is called so.
bool is_known(const std::string& name) {
  for (const System* system : systems()) {
    if (find_row(system->solvers(), name) || find_row(system->laws(), name)) return true;
    for (const VariantKey& key : system->keys())
      if (key.path.substr(0, key.path.find('.')) == name) return true;
  }
  return !embedded_text("scenarios/" + name + ".toml").empty() || !embedded_text("studies/" + name + ".toml").empty();
}

/// A name of a namespace, of files and of rows.
void check_name(const std::string& name) {
  const auto good = [](char c) {
    return std::islower(static_cast<unsigned char>(c)) || std::isdigit(static_cast<unsigned char>(c)) || c == '_';
  };
  // Words of C++ and names of C's library, which no namespace can have, and of targets and folders.
  static constexpr std::string_view taken =
      " alignas alignof and and_eq asm auto bitand bitor bool break case catch char class co_await co_return co_yield "
      "compl concept const const_cast consteval constexpr constinit continue decltype default delete do double "
      "dynamic_cast else enum explicit export extern false float for friend goto if inline int long mutable namespace "
      "new noexcept not not_eq nullptr operator or or_eq private protected public register reinterpret_cast requires "
      "return short signed sizeof static static_assert static_cast struct switch template this thread_local throw true "
      "try typedef typeid typename union unsigned using virtual void volatile wchar_t while xor xor_eq "
      "abs clock cos div exp floor free index j0 j1 log main pow read round signal sin sqrt std tan time write y0 y1 "
      "all build clean compare help install package results solenoid test ";
  if (name.empty() || name.size() > 40 || !std::ranges::all_of(name, good) ||
      !std::islower(static_cast<unsigned char>(name.front())) || taken.find(" " + name + " ") != std::string_view::npos)
    throw ConfigError(
        fmt::format("new: {} is no name (allowed: at most 40 small letters, digits and _, a letter first, and "
                    "no word of C++ or of its library)",
                    shown(name)));
  if (find_system(name))
    throw ConfigError(
        fmt::format("new: '{}' is a system already (allowed: names other than {})", name, system_names()));
  if (is_known(name)) throw ConfigError(fmt::format("new: '{}' is known already (allowed: a new name)", name));
}

std::string with_name(std::string_view text, const std::string& name) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t next = std::min(text.find(placeholder, at), text.size());
    result += text.substr(at, next - at);
    at = next;
    if (at < text.size()) result += name, at += placeholder.size();
  }
  return result;
}

void write_folder(const NewArguments& a) {
  check_name(a.name);
  const fs::path folder = a.folder.empty() ? a.name : a.folder;
  std::error_code unknown;
  if (fs::exists(folder, unknown))
    throw ConfigError(fmt::format("new: {} is there already (allowed: a new folder)", folder.string()));
  const std::string prefix = "plugin/templates/" + a.kind + "/";
  create_folder(folder.string());
  for (const std::string& file : embedded_names())
    if (file.starts_with(prefix))
      write_file_atomically((folder / with_name(file.substr(prefix.size()), a.name)).string(),
                            with_name(embedded_text(file), a.name));
  write_standard_output(
      fmt::format("{0}: builds and runs as it stands:\n\n"
                  "  cmake -S {0} -B {0}/build && cmake --build {0}/build\n"
                  "  solenoid compare {0}/compare.toml\n"
                  "  ctest --test-dir {0}/build\n\n"
                  "What to change is in {0}/{1}.cpp; docs/how-to/plug-ins.md tells the rest.\n",
                  folder.string(), a.name));
}

}  // namespace

void add_new(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<NewArguments>();
  CLI::App* command = app.add_subcommand("new", "write a folder with a plug-in of your own, ready to build");
  command->add_option("kind", arguments->kind, "what it adds: system, controller or solver")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(kinds), std::end(kinds))));
  command->add_option("name", arguments->name, "what it is called")->required();
  command->add_option("--out", arguments->folder, "the folder; default: the name")->type_name(value_kind::folder);
  command->callback([arguments, &exit_code] {
    write_folder(*arguments);
    exit_code = success;
  });
}

}  // namespace solenoid
