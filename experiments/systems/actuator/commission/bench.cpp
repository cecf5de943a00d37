#include "experiments/systems/actuator/commission/bench.hpp"

#include "core/systems/actuator/signals.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr int most_stale_ticks = 20;
constexpr int first_ticks = 5;  // of a part: what happened before it is over
constexpr double filter_hz = 50.0;

}  // namespace

Bench::Bench(Plant& plant, BenchClock& clock, const ModeSet& modes, double motor_limit_n, double tick_s,
             std::function<bool()> interrupted)
    : plant_(plant),
      clock_(clock),
      modes_(modes),
      limits_(modes, {motor_limit_n}),
      tick_s_(tick_s),
      interrupted_(std::move(interrupted)),
      filter_(filter_hz, 1 / tick_s),
      difference_(tick_s),
      start_s_(clock.now_s()) {}

void Bench::safe() noexcept { plant_.write(limits_.checked(limits_.safe_command())); }

void Bench::stop(const std::string& why) {
  safe();
  throw BenchStopped(why);
}

BenchSample Bench::look(const Measurement& sensors, double began_s) {
  BenchSample s;
  s.time_s = sensors.time_s - began_s;
  s.position_m = sensors.value[position_channel];
  s.fresh = sensors.stale_ticks == 0;
  s.pressure_pa = {sensors.value[pressure_a_channel], sensors.value[pressure_b_channel]};
  return s;
}

void Bench::require(const BenchSample& s, const BenchSample& first, const BenchGuard& guard) {
  if (!std::isfinite(s.position_m)) stop("the position is no number");
  for (const std::size_t k : {0u, 1u}) {
    const char name = k == 0 ? 'A' : 'B';
    if (!std::isfinite(s.pressure_pa[k])) stop(fmt::format("pressure {} is no number", name));
    if (s.pressure_pa[k] > std::max(guard.pressure_pa, first.pressure_pa[k] + 10e3))
      stop(fmt::format("pressure {} reads {:.0f} kPa gauge, above this step's {:.0f}", name,
                       1e-3 * (s.pressure_pa[k] - 101325.0), 1e-3 * (guard.pressure_pa - 101325.0)));
  }
  if (std::abs(s.position_m - first.position_m) > guard.travel_m)
    stop(fmt::format("the slide moved from {:.1f} to {:.1f} mm, further than this step's {:.0f} mm",
                     1e3 * first.position_m, 1e3 * s.position_m, 1e3 * guard.travel_m));
}

std::vector<BenchSample> Bench::play(double seconds, const BenchGuard& guard, const Law& law, const Until& until) {
  std::vector<BenchSample> samples;
  const auto count = static_cast<std::int64_t>(std::llround(seconds / tick_s_));
  samples.reserve(static_cast<std::size_t>(count));
  double began_s = 0.0;
  for (std::int64_t k = 0; k < count; ++k) {
    const auto passed = static_cast<std::int64_t>(std::floor((clock_.now_s() - start_s_) / tick_s_ + 1e-6));
    const std::int64_t next = std::max(tick_ + 1, passed);
    if (k > 0) {
      k += next - tick_ - 1;
      skipped_ += next - tick_ - 1;
    }
    tick_ = next;
    const double time_s = static_cast<double>(tick_) * tick_s_;
    clock_.sleep_until(start_s_ + time_s);
    const double asked_s = clock_.now_s();
    const Measurement sensors = plant_.read(time_s);
    if (samples.empty()) began_s = time_s;
    BenchSample s = look(sensors, began_s);
    s.read_us = 1e6 * (clock_.now_s() - asked_s);
    const bool settled = samples.size() >= first_ticks;
    if (interrupted_()) {
      safe();
      throw BenchInterrupted("interrupted");
    }
    if (sensors.stale_ticks > most_stale_ticks) stop("the sensors stay away");
    if (settled && sensors.node_was_safe) stop("the node went to its safe state by itself: commands came too late");
    require(s, samples.empty() ? s : samples.front(), guard);
    if (samples.empty()) filter_.reset(s.position_m), difference_.reset(s.position_m);
    s.slow_position_m = filter_.step(s.position_m);
    s.speed_m_s = difference_.step(s.slow_position_m);
    const Command wanted = law(s);
    s.applied = limits_.checked(wanted);
    plant_.write(s.applied);
    samples.push_back(s);
    if (until && until(s)) break;
  }
  return samples;
}

}  // namespace solenoid
