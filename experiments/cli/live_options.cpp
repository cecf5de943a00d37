#include "experiments/cli/live_options.hpp"

#include "experiments/report/live/live_server.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {

void add_live_options(CLI::App& command, bool& live, int& port) {
  CLI::Option* wanted =
      command.add_flag("--live", live, "serve the report on 127.0.0.1 while it fills, and after that until Ctrl-C");
  command
      .add_option("--live-port", port,
                  fmt::format("of the live page; default {}, or a free one if that is taken", usual_live_port))
      ->check(CLI::Range(1, 65535))
      ->needs(wanted);
}

}  // namespace solenoid
