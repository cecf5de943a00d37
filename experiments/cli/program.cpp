#include "core/config/one_line.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/build_info.hpp"
#include "experiments/base/files.hpp"
#include "experiments/campaign/plugins.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/option_values.hpp"
#include "experiments/cli/value_kinds.hpp"

#include <csignal>
#include <cstdio>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

namespace solenoid {
namespace {

int refuse(std::string_view what, int exit_code) {
  std::fprintf(stderr, "solenoid: %s\n", one_line(what).c_str());
  return exit_code;
}

/// What is wrong with a word as a command's name; nothing if it is one.
std::string problem_with_command(const CLI::App& app, const std::string& name) {
  std::string known;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->get_name() == name) return {};
    if (!command->get_group().empty()) known += (known.empty() ? "" : ", ") + command->get_name();
  }
  return "'" + name + "' is no command (allowed: " + known + ")";
}

/// Loads what --plugin names: the options of commands, and what they may be, depend on it. At a completion the last word
/// is only begun, and a plug-in that is refused adds nothing.
void load_plugins(int argc, char** argv) {
  constexpr std::string_view option = "--plugin";
  const bool completes = argc > 1 && argv[1] == std::string_view("complete");
  const int words = completes ? argc - 1 : argc;
  const auto load = [completes](const std::string& file) {
    try {
      load_plugin(file);
    } catch (const PluginError&) {
      if (!completes) throw;
    }
  };
  for (int i = 1; i < words; ++i) {
    const std::string_view word = argv[i];
    if (word == option && i + 1 < words)
      load(argv[++i]);
    else if (word.starts_with(option) && word.substr(option.size()).starts_with('='))
      load(std::string(word.substr(option.size() + 1)));
  }
}

/// It has been done by then: commands merely have the option.
void add_plugin_option(CLI::App& app, const std::shared_ptr<std::vector<std::string>>& files) {
  app.add_option("--plugin", *files, "load a plug-in, a shared object, repeatable: docs/how-to/plug-ins.md")
      ->type_name(value_kind::file)
      ->allow_extra_args(false);
  for (CLI::App* command : app.get_subcommands({}))
    if (!command->get_group().empty() && !command->get_name().empty() && command->get_name() != "man" &&
        command->get_name() != "completion")
      add_plugin_option(*command, files);
}

int run(int argc, char** argv) {
  load_plugins(argc, argv);
  CLI::App app("Solenoid: model predictive control of actuators whose inputs switch", "solenoid");
  app.set_version_flag("--version", [] {
    const BuildInfo build = build_info();
    return "solenoid " + build.version + (build.git_revision.empty() ? "" : " (" + build.git_revision + ")");
  });
  app.require_subcommand(1);
  int exit_code = success;
  add_compare(app, exit_code);
  add_list(app, exit_code);
  add_reproduce(app, exit_code);
  add_plot(app, exit_code);
  add_merge(app, exit_code);
  add_status(app, exit_code);
  add_report(app, exit_code);
  add_check(app, exit_code);
  add_scaling(app, exit_code);
  add_profile(app, exit_code);
  add_certify(app, exit_code);
  add_study(app, exit_code);
  add_ledger(app, exit_code);
  add_run(app, exit_code);
  add_commission(app, exit_code);
  add_emulator(app, exit_code);
  add_replay(app, exit_code);
  add_export(app, exit_code);
  add_faults(app, exit_code);
  add_chaos(app, exit_code);
  add_soak(app, exit_code);
  add_tune(app, exit_code);
  add_learn(app, exit_code);
  add_identify(app, exit_code);
  add_size(app, exit_code);
  add_new(app, exit_code);
  add_man(app, exit_code);
  add_completion(app, exit_code);
  add_complete(app, exit_code);
  const auto plugins = std::make_shared<std::vector<std::string>>();
  add_plugin_option(app, plugins);
  require_values(app);
  if (argc < 2) {
    write_standard_output(app.help());
    return success;
  }
  if (argv[1][0] != '-')
    if (const std::string problem = problem_with_command(app, argv[1]); !problem.empty())
      return refuse(problem, bad_input);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    return refuse(std::string(error.what()) + " (see solenoid --help)", bad_input);
  }
  return exit_code;
}

}  // namespace

int run_program(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond a limit of files' sizes is an error like a full disk's
  try {
    return run(argc, argv);
  } catch (const PluginError& error) {
    return refuse(error.what(), failure);
  } catch (const ConfigError& error) {
    return refuse(error.what(), bad_input);
  } catch (const OutputError& error) {
    return refuse(error.what(), bad_input);
  } catch (const std::bad_alloc&) {
    return refuse("out of memory", failure);
  } catch (const std::exception& error) {
    return refuse(error.what(), failure);
  }
}

}  // namespace solenoid
