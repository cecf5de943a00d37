#include "experiments/profile/hardware_counters.hpp"

#include "experiments/base/files.hpp"

#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace solenoid {
namespace {

struct Event {
  std::uint32_t type;
  std::uint64_t config;
};
constexpr std::array<Event, 5> events = {{{PERF_TYPE_HARDWARE, PERF_COUNT_HW_CPU_CYCLES},
                                          {PERF_TYPE_HARDWARE, PERF_COUNT_HW_INSTRUCTIONS},
                                          {PERF_TYPE_HARDWARE, PERF_COUNT_HW_BRANCH_MISSES},
                                          {PERF_TYPE_HARDWARE, PERF_COUNT_HW_CACHE_MISSES},
                                          {PERF_TYPE_SOFTWARE, PERF_COUNT_SW_PAGE_FAULTS}}};

int open_event(const Event& event) {
  perf_event_attr attributes{};
  attributes.size = sizeof attributes;
  attributes.type = event.type;
  attributes.config = event.config;
  attributes.disabled = 1;
  attributes.exclude_kernel = 1;
  attributes.exclude_hv = 1;
  return static_cast<int>(syscall(SYS_perf_event_open, &attributes, 0, -1, -1, 0));
}

/// What an errno of perf_event_open means for whoever wants the counters.
std::string explained(int error) {
  std::string paranoid = read_whole_file("/proc/sys/kernel/perf_event_paranoid").value_or("unknown\n");
  if (paranoid.ends_with('\n')) paranoid.pop_back();
  const char* advice = error == ENOENT || error == EOPNOTSUPP
                           ? "the processor's counters are not there, as in most virtual machines"
                       : error == EACCES || error == EPERM ? "the kernel does not allow it"
                       : error == ENOSYS                   ? "the kernel has none"
                                                           : "it failed";
  return fmt::format("perf_event_open: {}: {} (kernel.perf_event_paranoid = {})", std::strerror(error), advice,
                     paranoid);
}

}  // namespace

HardwareCounters::HardwareCounters() {
  for (std::size_t i = 0; i < events.size(); ++i) {
    descriptor_[i] = open_event(events[i]);
    if (descriptor_[i] < 0 && i < 2 && reason_.empty()) reason_ = explained(errno);
  }
}

HardwareCounters::~HardwareCounters() {
  for (const int descriptor : descriptor_)
    if (descriptor >= 0) close(descriptor);
}

void HardwareCounters::start() noexcept {
  for (const int descriptor : descriptor_)
    if (descriptor >= 0) ioctl(descriptor, PERF_EVENT_IOC_RESET, 0), ioctl(descriptor, PERF_EVENT_IOC_ENABLE, 0);
}

CounterValues HardwareCounters::stop() noexcept {
  CounterValues values;
  for (std::size_t i = 0; i < descriptor_.size(); ++i) {
    values.value[i] = -1;
    if (descriptor_[i] < 0) continue;
    ioctl(descriptor_[i], PERF_EVENT_IOC_DISABLE, 0);
    if (read(descriptor_[i], &values.value[i], sizeof(std::int64_t)) != sizeof(std::int64_t)) values.value[i] = -1;
  }
  return values;
}

}  // namespace solenoid
