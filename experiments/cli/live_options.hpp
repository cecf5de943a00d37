#pragma once

namespace CLI {
class App;
}

namespace solenoid {

/// --live and --live-port of the commands that can serve a page while they work.
void add_live_options(CLI::App& command, bool& live, int& port);

}  // namespace solenoid
