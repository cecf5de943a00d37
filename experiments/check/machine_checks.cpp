#include "experiments/base/machine.hpp"
#include "experiments/check/checks.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace solenoid {
namespace {

/// Tries something in a process of its own, so that this one keeps its scheduling and memory as they were; the errno.
template <class Attempt>
int errno_of(Attempt attempt) {
  const pid_t process = ::fork();
  if (process == 0) ::_exit(attempt() == 0 ? 0 : errno & 0xff);
  int status = 0;
  if (process < 0 || ::waitpid(process, &status, 0) < 0) return errno;
  return WIFEXITED(status) ? WEXITSTATUS(status) : EINVAL;
}

std::string limit_text(int resource) {
  rlimit limit{};
  if (::getrlimit(static_cast<__rlimit_resource>(resource), &limit) != 0) return "unknown";
  return limit.rlim_cur == RLIM_INFINITY ? "unlimited" : fmt::format("{}", limit.rlim_cur);
}

Check permission(const char* name, int error, int resource, const char* limit, const char* remedy) {
  const std::string detail = fmt::format("{} {}", limit, limit_text(resource));
  if (error == 0) return {"real time", name, "ok", detail};
  return {"real time", name, "missing", fmt::format("{}; {}: {}", detail, std::strerror(error), remedy)};
}

}  // namespace

std::vector<Check> check_machine() {
  const Machine machine = this_machine();
  const int scheduling = errno_of([] {
    sched_param priority{};
    priority.sched_priority = 80;
    return ::sched_setscheduler(0, SCHED_FIFO, &priority);
  });
  const int locking = errno_of([] { return ::mlockall(MCL_CURRENT | MCL_FUTURE); });
  const bool rt_kernel = std::filesystem::exists("/sys/kernel/realtime");
  return {{"machine", "cpu", "info", machine.cpu},
          {"machine", "cores", "info", fmt::format("{}", machine.cores)},
          {"machine", "kernel", "info", machine.kernel + (rt_kernel ? ", PREEMPT_RT" : ", not a real-time kernel")},
          permission("SCHED_FIFO 80", scheduling, RLIMIT_RTPRIO, "RLIMIT_RTPRIO",
                     "'@realtime - rtprio 95' in /etc/security/limits.d"),
          permission("mlockall", locking, RLIMIT_MEMLOCK, "RLIMIT_MEMLOCK",
                     "'@realtime - memlock unlimited' in /etc/security/limits.d")};
}

}  // namespace solenoid
