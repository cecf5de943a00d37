#include "experiments/base/machine.hpp"

#include "experiments/base/build_info.hpp"
#include "experiments/base/files.hpp"

#include <chrono>
#include <ctime>
#include <fstream>
#include <string_view>

#include <dlfcn.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/utsname.h>

namespace solenoid {
namespace {

std::string cpu_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("model name"))
      if (const auto colon = line.find(": "); colon != std::string::npos) return line.substr(colon + 2);
  return "unknown";
}

std::tm local_now() { return fmt::localtime(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now())); }

}  // namespace

std::string machine_name() {
  utsname system{};
  return uname(&system) == 0 ? system.nodename : "unknown";
}

Machine this_machine() {
  Machine m;
  utsname system{};
  if (uname(&system) == 0) m.kernel = fmt::format("{} {} {}", system.sysname, system.release, system.machine);
  m.host = machine_name();
  m.cpu = cpu_name();
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) m.cores = CPU_COUNT(&allowed);
  return m;
}

const std::string& program_fingerprint() {
  static const std::string value = [] {
    Dl_info here{};  // in Python the program is Python, which says nothing of this
    const bool known = ::dladdr(reinterpret_cast<const void*>(&program_fingerprint), &here) != 0;
    const bool shared = known && std::string_view(here.dli_fname).ends_with(".so");
    const auto program = read_whole_file(shared ? here.dli_fname : "/proc/self/exe");
    return fingerprint(program ? *program : build_info().version + build_info().git_revision);
  }();
  return value;
}

std::string timestamp() { return fmt::format("{:%Y-%m-%dT%H:%M:%S%z}", local_now()); }

std::string compact_timestamp() { return fmt::format("{:%Y%m%d-%H%M%S}", local_now()); }

}  // namespace solenoid
