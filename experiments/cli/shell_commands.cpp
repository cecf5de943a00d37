#include "experiments/base/build_info.hpp"
#include "experiments/base/embedded.hpp"
#include "experiments/base/files.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/completion.hpp"
#include "experiments/cli/man_page.hpp"

#include <memory>

#include <CLI/CLI.hpp>

namespace solenoid {
namespace {

std::string lines_of(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += word + "\n";
  return text;
}

}  // namespace

void add_man(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("man", "the manual page of everything, for man: solenoid man | man -l -");
  command->callback([&app, &exit_code] {
    write_standard_output(man_page(app, build_info().version));
    exit_code = success;
  });
}

void add_completion(CLI::App& app, int& exit_code) {
  const auto shell = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(
      "completion", "what makes a shell complete commands, options and names: . <(solenoid completion bash)");
  command->add_option("shell", *shell, "bash")->required()->check(CLI::IsMember({"bash"}));
  command->callback([shell, &exit_code] {
    write_standard_output(std::string(embedded_text("cli/completion.bash")));
    exit_code = success;
  });
}

void add_complete(CLI::App& app, int& exit_code) {
  const auto words = std::make_shared<std::vector<std::string>>();
  CLI::App* command = app.add_subcommand("complete", "what can stand at the end of these words")->group("");
  command->add_option("words", *words, "the command line after the program's name, the last word begun");
  command->callback([&app, words, &exit_code] {
    write_standard_output(lines_of(completions(app, *words)));
    exit_code = success;
  });
}

}  // namespace solenoid
