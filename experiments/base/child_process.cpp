#include "experiments/base/child_process.hpp"

#include "experiments/base/interrupt.hpp"

#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace solenoid {
namespace {

/// Of /proc/ID/stat, whose second field may hold anything but ends with the last ')'.
pid_t parent_of(const std::filesystem::path& process) {
  std::ifstream in(process / "stat");
  std::string text((std::istreambuf_iterator<char>(in)), {});
  const std::size_t end = text.rfind(')');
  if (end == std::string::npos) return -1;
  std::istringstream rest(text.substr(end + 1));
  std::string state;
  pid_t parent = -1;
  rest >> state >> parent;
  return parent;
}

}  // namespace

void wait_s(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

bool wait_until(const std::function<bool()>& happened, double most_s) {
  constexpr double look_s = 0.02;
  for (double waited = 0.0; waited < most_s; waited += look_s) {
    if (happened()) return true;
    wait_s(look_s);
  }
  return false;
}

std::string this_program() { return std::filesystem::read_symlink("/proc/self/exe").string(); }

std::string program_on_path(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (folder += '/' + name; ::access(folder.c_str(), X_OK) == 0) return folder;
  return {};
}

Child::Child(const std::string& program, std::vector<std::string> arguments, const std::string& output,
             const std::function<void()>& before) {
  arguments.insert(arguments.begin(), program);
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (std::string& a : arguments) argv.push_back(a.data());
  argv.push_back(nullptr);
  pid_ = ::fork();
  if (pid_ != 0) return;
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const int file = ::open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  ::dup2(file, STDOUT_FILENO);
  ::dup2(file, STDERR_FILENO);
  ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
  InterruptGuard::leave_in_child();
  for (const int signal : {SIGINT, SIGQUIT}) std::signal(signal, SIG_DFL);
  before();
  ::execv(program.c_str(), argv.data());
  ::_exit(127);
}

Child::~Child() {
  if (!runs()) return;
  for (const int signal : {SIGCONT, SIGKILL}) {
    ::kill(-pid_, signal);
    ::kill(pid_, signal);
  }
  ::waitpid(pid_, nullptr, 0);
}

void Child::send(int signal) const {
  if (pid_ > 0) ::kill(pid_, signal);
}

bool Child::runs() {
  if (pid_ <= 0) return false;
  int status = 0;
  if (::waitpid(pid_, &status, WNOHANG) != pid_) return true;
  pid_ = -1;
  code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return false;
}

int Child::wait(double most_s) {
  wait_until([&] { return !runs(); }, most_s);
  return runs() ? -1 : code_;
}

std::vector<pid_t> children_of(pid_t parent) {
  std::vector<pid_t> found;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", ignored)) {
    const std::string name = entry.path().filename();
    pid_t id = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), id);
    if (error == std::errc() && end == name.data() + name.size() && parent_of(entry.path()) == parent)
      found.push_back(id);
  }
  return found;
}

}  // namespace solenoid
