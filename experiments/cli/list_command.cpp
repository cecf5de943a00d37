#include "experiments/cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace solenoid {

void add_list(CLI::App& app, int& exit_code) {
  CLI::App* list = app.add_subcommand("list", "what there is: variants");
  list->callback([&exit_code] { exit_code = success; });
}

}  // namespace solenoid
