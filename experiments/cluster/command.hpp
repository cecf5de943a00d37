#pragma once

#include <string>
#include <vector>

namespace solenoid {

/// What a program that was run to its end said.
struct CommandOutput {
  int exit_code = -1;
  std::string text;  ///< standard output and standard error, as they come
  bool ok() const { return exit_code == 0; }
  /// The text as one line.
  std::string line() const;
};

/// Runs a program of PATH. Throws ConfigError naming the Debian package if it is not there, or if it does not end within a
/// minute.
CommandOutput run_command(const std::string& program, const std::vector<std::string>& arguments,
                          const std::string& package);

/// Text as one word of a shell script.
std::string shell_quoted(const std::string& text);

}  // namespace solenoid
