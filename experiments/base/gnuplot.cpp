#include "experiments/base/gnuplot.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr const char* complaints_file = "complaints.txt";

/// What posix_spawn does in the child before gnuplot starts.
class SpawnActions {
 public:
  explicit SpawnActions(const std::filesystem::path& folder) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addchdir_np(&actions_, folder.c_str());
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&actions_, STDERR_FILENO, complaints_file, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  }
  ~SpawnActions() { posix_spawn_file_actions_destroy(&actions_); }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;
  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_;
};

std::string first_complaint(const std::filesystem::path& folder) {
  std::ifstream in(folder / complaints_file);
  std::string line;
  while (std::getline(in, line))
    if (line.find_first_not_of(" \t^") != std::string::npos) return line;
  return "no message";
}

}  // namespace

void run_gnuplot(const std::filesystem::path& folder, const std::string& script) {
  std::string program = "gnuplot", no_user_settings = "--default-settings", file = script;
  char* const arguments[] = {program.data(), no_user_settings.data(), file.data(), nullptr};
  pid_t child = 0;
  const int error = posix_spawnp(&child, program.c_str(), SpawnActions(folder).get(), nullptr, arguments, environ);
  if (error == ENOENT || error == EACCES)
    throw ConfigError(
        "gnuplot, which draws the figures, is not installed (install it with: apt-get install gnuplot-nox)");
  if (error != 0) throw std::runtime_error(fmt::format("gnuplot cannot be started: {}", std::strerror(error)));
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error(fmt::format("gnuplot failed: {}", first_complaint(folder)));
}

void draw_with_gnuplot(const std::map<std::string, std::string>& files, const std::string& script,
                       const std::string& path) {
  const TemporaryFolder folder;
  for (const auto& [name, text] : files) write_file_atomically((folder.path() / name).string(), text);
  write_file_atomically((folder.path() / "script").string(), script);
  run_gnuplot(folder.path(), "script");
  const auto figure = read_whole_file((folder.path() / "figure").string());
  if (!figure) throw OutputError(path + ": gnuplot drew nothing");
  write_file_atomically(path, *figure);
}

std::string gnuplot_quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\' || c == '@' || c == '`')
      quoted += fmt::format("\\{:03o}", static_cast<unsigned>(c));
    else
      quoted += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
  }
  return quoted + "\"";
}

}  // namespace solenoid
