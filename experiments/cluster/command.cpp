#include "experiments/cluster/command.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"

#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {

std::string CommandOutput::line() const {
  std::string joined;
  std::istringstream lines(text);
  for (std::string one; std::getline(lines, one);) joined += (joined.empty() ? "" : "; ") + one;
  return joined;
}

CommandOutput run_command(const std::string& program, const std::vector<std::string>& arguments,
                          const std::string& package) {
  constexpr double most_s = 60.0;
  const std::string file = program_on_path(program);
  if (file.empty())
    throw ConfigError(fmt::format("{} is not there (install it with: apt-get install {})", program, package));
  const TemporaryFolder folder;
  const std::string output = (folder.path() / "output").string();
  Child child(file, arguments, output);
  CommandOutput out;
  out.exit_code = child.wait(most_s);
  if (out.exit_code < 0) throw ConfigError(fmt::format("{}: did not answer within {:g} s", program, most_s));
  out.text = read_whole_file(output).value_or("");
  return out;
}

std::string shell_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'')
      quoted += "'\\''";
    else
      quoted += c;
  }
  return quoted + "'";
}

}  // namespace solenoid
