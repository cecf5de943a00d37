#include "experiments/cli/command_tree.hpp"

#include <regex>
#include <sstream>

#include <CLI/CLI.hpp>

namespace solenoid {

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) {
    return !command->get_name().empty() && !command->get_group().empty() && !command->get_disabled();
  });
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  std::vector<const CLI::Option*> options = app.get_options(
      [](const CLI::Option* option) { return option->nonpositional() && !option->get_group().empty(); });
  for (const CLI::App* group : app.get_subcommands([](const CLI::App* part) { return part->get_name().empty(); }))
    for (const CLI::Option* option : options_of(*group))
      if (option != group->get_help_ptr()) options.push_back(option);
  return options;
}

std::vector<const CLI::Option*> positionals_of(const CLI::App& app) {
  return app.get_options(
      [](const CLI::Option* option) { return option->get_positional() && !option->get_group().empty(); });
}

std::string words_of(const CLI::App& app) {
  return app.get_parent() ? words_of(*app.get_parent()) + " " + app.get_name() : app.get_name();
}

bool takes_value(const CLI::Option& option) { return option.get_type_size() != 0 && option.get_expected_max() > 0; }

bool takes_several(const CLI::Option& option) {
  return takes_value(option) && option.get_expected_max() > 1 && option.get_allow_extra_args();
}

std::string kind_of(const CLI::Option& option) {
  const std::string full = option.get_type_name();
  return full.substr(0, full.find(':'));
}

// CLI11 keeps no set or limits, only their description: {a,b,c}, INT in [1 - 1024], POSITIVE.

std::vector<std::string> allowed_values(const CLI::Option& option) {
  const std::string full = option.get_type_name();
  const std::size_t begin = full.find('{'), end = full.rfind('}');
  if (begin == std::string::npos || end == std::string::npos) return {};
  std::istringstream list(full.substr(begin + 1, end - begin - 1));
  std::vector<std::string> values;
  for (std::string value; std::getline(list, value, ',');) values.push_back(value);
  return values;
}

std::string allowed_range(const CLI::Option& option) {
  static const std::regex range(R"( in \[(\S+) - (\S+)\])");
  const std::string full = option.get_type_name();
  std::smatch found;
  if (std::regex_search(full, found, range)) return found.str(1) + " to " + found.str(2);
  return full.find(":POSITIVE") != std::string::npos ? "more than 0" : "";
}

}  // namespace solenoid
