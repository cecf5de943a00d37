#include "core/config/reader.hpp"
#include "experiments/cli/commands.hpp"

#include <cstdio>

#include <CLI/CLI.hpp>

int main(int argc, char** argv) {
  CLI::App app("Solenoid: model predictive control of actuators whose inputs switch", "solenoid");
  app.require_subcommand(1);
  int exit_code = solenoid::success;
  solenoid::add_list(app, exit_code);
  solenoid::add_reproduce(app, exit_code);
  solenoid::add_plot(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? solenoid::success : solenoid::bad_input;
  } catch (const solenoid::ConfigError& error) {
    std::fprintf(stderr, "solenoid: %s\n", error.what());
    return solenoid::bad_input;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "solenoid: %s\n", error.what());
    return solenoid::failure;
  }
  return exit_code;
}
