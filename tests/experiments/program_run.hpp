#pragma once

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

namespace solenoid::test {

/// What the built program did when it was run with some arguments.
struct ProgramRun {
  int exit_code = -1;
  std::string out, err;
};

/// A folder that lives as long as the object.
class Folder {
 public:
  Folder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "solenoid-test-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  bool empty() const { return std::filesystem::is_empty(path_); }

 private:
  std::filesystem::path path_;
};

inline std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Runs the program without a shell; `path` replaces PATH and `output` the captured standard output when not empty.
inline ProgramRun run_program(std::vector<std::string> arguments, const std::string& path = "",
                              const std::string& output = "") {
  const Folder folder;
  const std::string out = output.empty() ? (folder / "out").string() : output, err = folder / "err";
  arguments.insert(arguments.begin(), SOLENOID_PROGRAM);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    if (!path.empty()) setenv("PATH", path.c_str(), 1);
    if (freopen(out.c_str(), "w", stdout) == nullptr || freopen(err.c_str(), "w", stderr) == nullptr) _exit(126);
    execv(SOLENOID_PROGRAM, argv.data());
    _exit(127);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, output.empty() ? text_of(out) : "", text_of(err)};
}

}  // namespace solenoid::test
