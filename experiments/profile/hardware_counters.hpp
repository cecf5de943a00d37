#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace solenoid {

/// Events of this thread in user mode.
struct CounterValues {
  static constexpr std::array<const char*, 5> names = {"cycles", "instructions", "branch_misses", "cache_misses",
                                                       "page_faults"};
  std::array<std::int64_t, 5> value{};  ///< -1: the machine does not count it
};

/// The processor's counters through perf_event_open, one descriptor an event: what the kernel or the machine does not
/// give is left out, with its reason.
class HardwareCounters {
 public:
  HardwareCounters();
  ~HardwareCounters();
  HardwareCounters(const HardwareCounters&) = delete;
  HardwareCounters& operator=(const HardwareCounters&) = delete;

  /// Whether cycles and instructions are counted.
  bool available() const { return descriptor_[0] >= 0 && descriptor_[1] >= 0; }
  /// Why not, in one line; empty when available.
  const std::string& reason() const { return reason_; }
  void start() noexcept;
  CounterValues stop() noexcept;

 private:
  std::array<int, 5> descriptor_{};
  std::string reason_;
};

}  // namespace solenoid
