#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace solenoid {

/// Parts of a solve worth a line in a profile. What belongs to none of them is the solver's bookkeeping.
enum class Phase : std::uint8_t { rollout, derivatives, factorisation, bound };
/// The phases' names, in their order.
inline constexpr std::array phase_names = {"rollout", "derivatives", "factorisation", "bound"};
/// How many phases there are.
inline constexpr std::size_t phase_count = phase_names.size();

/// Time spent in each phase, in ticks of the processor's own counter.
struct PhaseTimes {
  std::array<std::uint64_t, phase_count> ticks{};
};

/// The counter: on x86 the time-stamp counter, some twenty cycles a reading; elsewhere the monotonic clock.
inline std::uint64_t phase_ticks() noexcept {
#if defined(__x86_64__)
  return __builtin_ia32_rdtsc();  // <x86intrin.h> takes a second to read
#else
  return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
#endif
}

/// Adds its lifetime to a phase, unless there is nowhere to add it.
class PhaseScope {
 public:
  PhaseScope(PhaseTimes* times, Phase phase) noexcept
      : times_(times), phase_(phase), begin_(times ? phase_ticks() : 0) {}
  ~PhaseScope() {
    if (times_) times_->ticks[static_cast<std::size_t>(phase_)] += phase_ticks() - begin_;
  }
  PhaseScope(const PhaseScope&) = delete;
  PhaseScope& operator=(const PhaseScope&) = delete;

 private:
  PhaseTimes* times_;
  Phase phase_;
  std::uint64_t begin_;
};

}  // namespace solenoid
