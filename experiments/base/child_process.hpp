#pragma once

#include <functional>
#include <string>
#include <vector>

#include <sys/types.h>

namespace solenoid {

void wait_s(double seconds);
/// Whether it happened in that time; asked fifty times a second.
bool wait_until(const std::function<bool()>& happened, double most_s);

/// The file of the running program. Throws std::filesystem::filesystem_error where the system does not tell.
std::string this_program();

/// Where a program lies on PATH; none: nowhere.
std::string program_on_path(const std::string& name);

/// A process of a program, standard output and error in a file. It gets a process group of its own, which ends with the
/// object.
class Child {
 public:
  /// `before`: called in the child before the program starts.
  Child(
      const std::string& program, std::vector<std::string> arguments, const std::string& output,
      const std::function<void()>& before = [] {});
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  pid_t id() const { return pid_; }
  void send(int signal) const;
  /// Whether it still runs.
  bool runs();
  /// Its exit code, 128 + signal, or -1 if it has not ended by then.
  int wait(double most_s);

 private:
  pid_t pid_ = -1;
  int code_ = -1;
};

/// The processes whose parent is this one.
std::vector<pid_t> children_of(pid_t parent);

}  // namespace solenoid
