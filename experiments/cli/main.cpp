#include "core/config/reader.hpp"
#include "experiments/base/build_info.hpp"
#include "experiments/base/files.hpp"
#include "experiments/cli/commands.hpp"

#include <cstdio>

#include <CLI/CLI.hpp>

namespace {

int refuse(const char* what, int exit_code) {
  std::fprintf(stderr, "solenoid: %s\n", what);
  return exit_code;
}

/// What is wrong with a word as a command's name; nothing if it is one.
std::string problem_with_command(const CLI::App& app, const std::string& name) {
  std::string known;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->get_name() == name) return {};
    known += (known.empty() ? "" : ", ") + command->get_name();
  }
  return "'" + name + "' is no command (allowed: " + known + ")";
}

int run(int argc, char** argv) {
  CLI::App app("Solenoid: model predictive control of actuators whose inputs switch", "solenoid");
  app.set_version_flag("--version", [] {
    const solenoid::BuildInfo build = solenoid::build_info();
    return "solenoid " + build.version + (build.git_revision.empty() ? "" : " (" + build.git_revision + ")");
  });
  app.require_subcommand(1);
  int exit_code = solenoid::success;
  solenoid::add_compare(app, exit_code);
  solenoid::add_list(app, exit_code);
  solenoid::add_reproduce(app, exit_code);
  solenoid::add_plot(app, exit_code);
  solenoid::add_report(app, exit_code);
  solenoid::add_check(app, exit_code);
  solenoid::add_scaling(app, exit_code);
  solenoid::add_profile(app, exit_code);
  solenoid::add_study(app, exit_code);
  solenoid::add_ledger(app, exit_code);
  solenoid::add_run(app, exit_code);
  solenoid::add_emulator(app, exit_code);
  solenoid::add_replay(app, exit_code);
  solenoid::add_export(app, exit_code);
  solenoid::add_faults(app, exit_code);
  solenoid::add_tune(app, exit_code);
  solenoid::add_identify(app, exit_code);
  solenoid::add_size(app, exit_code);
  if (argc < 2) {
    solenoid::write_standard_output(app.help());
    return solenoid::success;
  }
  if (argv[1][0] != '-')
    if (const std::string problem = problem_with_command(app, argv[1]); !problem.empty())
      return refuse(problem.c_str(), solenoid::bad_input);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    return refuse((std::string(error.what()) + " (see solenoid --help)").c_str(), solenoid::bad_input);
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const solenoid::ConfigError& error) {
    return refuse(error.what(), solenoid::bad_input);
  } catch (const solenoid::OutputError& error) {
    return refuse(error.what(), solenoid::bad_input);
  } catch (const std::exception& error) {
    return refuse(error.what(), solenoid::failure);
  }
}
