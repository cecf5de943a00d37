#include "experiments/rig/wire_check.hpp"

#include "core/rt/clock.hpp"

#include <cmath>

#include <fmt/format.h>

namespace solenoid {
std::optional<WireHealth> watch_wire(RigPlant& rig, double seconds, double tick_s) {
  MonotonicClock clock;
  const auto ticks = static_cast<int>(std::ceil(seconds / tick_s));
  if (!rig.io().health().wire) return std::nullopt;
  for (int k = 0; k < ticks; ++k) {
    clock.sleep_until((k + 1) * tick_s);
    rig.read(k * tick_s);
  }
  return rig.io().health().wire;
}

std::vector<WireFinding> wire_checks(const WireHealth& wire, double tick_s, const WireLimits& limits) {
  const double wait_us = 1e6 * limits.wait_s, jitter_us = 1e6 * limits.jitter_s;
  const bool prompt = wire.round_trip_us.p99 <= wait_us, steady = wire.jitter_us() <= jitter_us;
  const bool kept = wire.loss() < limits.loss, alike = std::abs(wire.drift_ppm) <= 1e6 * limits.drift;
  const bool answered = wire.answered > 0;
  const auto verdict = [&]() -> std::string {
    if (!answered) return "no: nothing was answered";
    if (!kept) return fmt::format("no: {:.0f} % or more of the requests have no answer", 100 * limits.loss);
    if (!alike) return fmt::format("no: the clocks drift by more than {:.0f} ppm", 1e6 * limits.drift);
    if (prompt) return "yes: samples are of the tick that asks";
    if (steady) return "yes: samples are late, and estimators are told by how much";
    return fmt::format("no: the wire is neither quicker than {:.0f} us nor steadier than {:.0f}", wait_us, jitter_us);
  };
  return {{"round trip", answered && (prompt || steady),
           fmt::format("p50 {:.0f} us, p99 {:.0f} us, max {:.0f} us; a read waits {:.0f}", wire.round_trip_us.p50,
                       wire.round_trip_us.p99, wire.round_trip_us.max, wait_us)},
          {"jitter", prompt || steady,
           fmt::format("{:.0f} us a direction (at most {:.0f} where the round trip's p99 is beyond {:.0f} us)",
                       wire.jitter_us(), jitter_us, wait_us)},
          {"loss", answered && kept,
           fmt::format("{:.2f} % of {} requests (less than {:.0f} %), {} answers overtaken", 100 * wire.loss(),
                       wire.answered + wire.lost, 100 * limits.loss, wire.reordered)},
          {"clock", alike,
           fmt::format("the node's drifts by {:+.1f} ppm (at most {:.0f}); ages are right to {:.0f} us", wire.drift_ppm,
                       1e6 * limits.drift, wire.clock_error_us)},
          {fmt::format("{:g} Hz", 1.0 / tick_s), answered && kept && alike && (prompt || steady), verdict()}};
}

}  // namespace solenoid
