#pragma once

#include <string>

namespace CLI {
class App;
}

namespace solenoid {

/// The manual page solenoid(1) in the man macros of roff: every command below `app` with what its --help says.
std::string man_page(const CLI::App& app, const std::string& version);

}  // namespace solenoid
