#pragma once

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace solenoid::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool sanitized = true;  ///< memory and time are a sanitizer's own: it keeps what was freed
#else
constexpr bool sanitized = false;
#endif
#ifdef __SANITIZE_THREAD__
constexpr bool may_limit_files = false;  ///< this sanitizer's runtime writes a large one of its own before main()
#else
constexpr bool may_limit_files = true;
#endif

/// A folder of its own for a test, removed afterwards.
class Folder {
 public:
  Folder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "solenoid test XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string file(const std::string& name) const { return path_ + "/" + name; }
  std::filesystem::path operator/(const std::string& name) const { return file(name); }
  bool empty() const { return std::filesystem::is_empty(path_); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(file(name)) << text;
    return file(name);
  }
  /// A program that does what a shell script says.
  std::string write_script(const std::string& name, const std::string& script) const {
    std::string program = write(name, "#!/bin/sh\n" + script);
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    return program;
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

inline std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What the built program did when it was run with some arguments.
struct ProgramRun {
  int exit_code = -1;
  std::string out, err;
};

/// Runs the program in `folder` through a shell; `before` is a shell command such as `ulimit -f 1;`.
inline ProgramRun run_program(const Folder& folder, const std::string& arguments, const std::string& before = "") {
  const std::string command =
      "cd '" + folder.path() + "' && " + before + " '" SOLENOID_PROGRAM "' " + arguments + " >.out 2>.err </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status), text_of(folder.file(".out")),
          text_of(folder.file(".err"))};
}

/// What the program says to arguments that it must refuse: exit code 2, nothing on standard output.
inline std::string refusal_of(const Folder& folder, const std::string& arguments) {
  const ProgramRun run = run_program(folder, arguments);
  EXPECT_EQ(run.exit_code, 2) << arguments;
  EXPECT_EQ(run.out, "") << arguments;
  return run.err;
}

/// Runs the program without a shell; `path` replaces PATH and `output` the captured standard output when not empty.
inline ProgramRun run_program(std::vector<std::string> arguments, const std::string& path = "",
                              const std::string& output = "") {
  const Folder folder;
  const std::string out = output.empty() ? (folder / "out").string() : output, err = folder / "err";
  arguments.insert(arguments.begin(), SOLENOID_PROGRAM);
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
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

/// Of 127.0.0.1, nobody's a moment ago.
inline int free_udp_port() {
  const int file = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  const bool bound = ::bind(file, reinterpret_cast<const sockaddr*>(&at), size) == 0 &&
                     ::getsockname(file, reinterpret_cast<sockaddr*>(&at), &size) == 0;
  ::close(file);
  EXPECT_TRUE(bound);
  return ntohs(at.sin_port);
}

inline std::vector<std::string> split(const std::string& line, char by) {
  std::vector<std::string> parts;
  std::istringstream in(line);
  for (std::string part; std::getline(in, part, by);) parts.push_back(part);
  return parts;
}

/// A CSV without quotes, each line a map from heading to cell.
inline std::vector<std::map<std::string, std::string>> read_csv(const std::string& text) {
  const std::vector<std::string> lines = split(text, '\n');
  std::vector<std::map<std::string, std::string>> rows;
  const std::vector<std::string> headings = split(lines.at(0), ',');
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::vector<std::string> cells = split(lines[i], ',');
    rows.emplace_back();
    for (std::size_t c = 0; c < headings.size(); ++c) rows.back()[headings[c]] = c < cells.size() ? cells[c] : "";
  }
  return rows;
}

/// A campaign of 2 x 2 x 2 noisy runs, each a fraction of a second long.
inline const char* const small_campaign = R"(
variants = ["thesis_cylinder", "nine_pd"]
seeds = [3, 4]
[[scenario]]
name = "step"
trajectory = { kind = "step", height_m = 0.03, at_s = 0.05, hold_s = 0.3, steady_s = 0.1 }
noise = true
[[scenario]]
name = "loaded"
trajectory = { kind = "sine", lead_s = 0.2, periods = 0.5 }
payload_kg = 0.15
noise = true
duration_s = 0.4
)";

}  // namespace solenoid::test
