#include "experiments/rig/wire_check.hpp"

#include "core/rt/clock.hpp"
#include "experiments/rig/node_protocol.hpp"
#include "experiments/rig/udp_io.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {

WireLimits wire_limits(double tick_s) {
  constexpr double stale_ticks = 11.0, hour_s = 3600.0;
  const UdpSettings times = timed_for({}, tick_s);
  const double in_a_row = std::min(stale_ticks, std::max(1.0, std::floor(node_timeout_s / tick_s)));
  return {times.wait_s, 2.0 * tick_s, 5.0 * tick_s, times.most_age_s, std::pow(tick_s / hour_s, 1.0 / in_a_row)};
}

std::optional<WireHealth> watch_wire(RigPlant& rig, double seconds, double tick_s) {
  if (!rig.io().health().wire) return std::nullopt;
  rig.io().watch_anew();
  MonotonicClock clock;
  const auto ticks = static_cast<int>(std::ceil(seconds / tick_s));
  for (int k = 0; k < ticks; ++k) {
    clock.sleep_until((k + 1) * tick_s);
    rig.read(k * tick_s);
  }
  return rig.io().health().wire;
}

std::vector<WireFinding> wire_checks(const WireHealth& wire, double tick_s) {
  const WireLimits limits = wire_limits(tick_s);
  const double wait_us = 1e6 * limits.wait_s, jitter_us = 1e6 * limits.jitter_s, age_us = 1e6 * limits.age_s;
  const double empty = wire.reads > 0 ? static_cast<double>(wire.missed) / static_cast<double>(wire.reads) : 0.0;
  const bool answered = wire.answered > 0, prompt = answered && wire.round_trip_us.p99 <= wait_us;
  const bool steady = answered && wire.jitter_us() <= jitter_us,
             near = wire.least_round_trip_us <= 1e6 * limits.delay_s;
  const bool young = wire.age_us.p99 <= age_us && empty < limits.empty;
  const bool kept = answered && wire.loss() < limits.loss;
  const bool alike = std::abs(wire.drift_ppm) <= 1e6 * limits.drift && wire.clock_jumps == 0;
  const auto verdict = [&]() -> std::string {
    if (!answered) return "no: nothing was answered";
    if (!kept) return fmt::format("no: {:.3g} % or more of the requests have no answer", 100 * limits.loss);
    if (!alike) return "no: the node's clock does not go as ours does";
    if (!near) return fmt::format("no: the quickest round trip takes more than {:.0f} ticks", limits.delay_s / tick_s);
    if (!prompt && !steady)
      return fmt::format("no: the wire is neither quicker than {:.0f} us nor steadier than {:.0f}", wait_us, jitter_us);
    if (!young) return "no: too many reads have no sample that is young enough";
    return prompt ? "yes: samples are of the tick that asks"
                  : "yes: samples are late, and estimators that know ages are told by how much";
  };
  return {
      {"round trip", near && (prompt || steady),
       fmt::format("least {:.0f}, p50 {:.0f}, p99 {:.0f}, max {:.0f} us; a read waits {:.0f}", wire.least_round_trip_us,
                   wire.round_trip_us.p50, wire.round_trip_us.p99, wire.round_trip_us.max, wait_us)},
      {"jitter", prompt || steady,
       fmt::format("{:.0f} us a direction (at most {:.0f} where the round trip's p99 is beyond {:.0f} us)",
                   wire.jitter_us(), jitter_us, wait_us)},
      {"age", young,
       fmt::format("p99 {:.0f} us (at most {:.0f}), right to {:.0f} us; {:.1f} % of {} reads had nothing newer (less "
                   "than {:.0f} %)",
                   wire.age_us.p99, age_us, wire.clock_error_us, 100 * empty, wire.reads, 100 * limits.empty)},
      {"loss", kept,
       fmt::format("{:.2f} % of {} requests (less than {:.3g} %), {} answers overtaken", 100 * wire.loss(),
                   wire.answered + wire.lost, 100 * limits.loss, wire.reordered)},
      {"clock", alike,
       fmt::format("the node's drifts by {:+.1f} ppm (at most {:.0f}){}", wire.drift_ppm, 1e6 * limits.drift,
                   wire.clock_jumps > 0 ? fmt::format(" and jumped {} times", wire.clock_jumps) : "")},
      {fmt::format("{:g} Hz", 1.0 / tick_s), kept && alike && near && (prompt || steady) && young, verdict()}};
}

}  // namespace solenoid
