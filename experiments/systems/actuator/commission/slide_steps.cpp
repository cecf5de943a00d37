#include "core/systems/actuator/signals.hpp"
#include "experiments/systems/actuator/commission/steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double moved_m = 1e-3, seen_m = 0.5e-3;
constexpr double stop_band_m = 1.5e-3;
const double no_pressure_bound = std::numeric_limits<double>::infinity();

/// Where a creep ended, and why.
struct CreepEnd {
  double position_m = 0.0;
  bool at_rail = false;  ///< beyond what the converter shows
};

/// The motor carries the slide along a line until it stands against something, or nothing can be read further on.
CreepEnd creep(CommissionState& state, double direction, double to_m, double longest_s) {
  constexpr double speed = 0.04, lead_m = 6e-3, stiffness = 800.0, damping = 100.0, limit_n = 5.0;
  constexpr double still_m = 0.2e-3, still_s = 0.3, rail_m = 0.6e-3;
  const SensorBounds& ends = state.settings.plausibility.channels[position_channel];
  const SwitchPattern vented = CoilPatterns(state.three_way).exhaust_both();
  double reference_m = 0.0, rested_m = 0.0, since_s = 0.0;
  CreepEnd end;
  const auto samples = state.bench.play(
      longest_s, {1.0, no_pressure_bound},
      [&](const BenchSample& s) {
        if (s.time_s == 0.0) reference_m = rested_m = s.slow_position_m;
        reference_m += direction * speed * state.bench.tick_s();
        reference_m = std::clamp(reference_m, s.slow_position_m - lead_m, s.slow_position_m + lead_m);
        if ((to_m - reference_m) * direction < 0.0) reference_m = to_m;
        if (std::abs(s.slow_position_m - rested_m) > still_m) rested_m = s.slow_position_m, since_s = s.time_s;
        const double force =
            stiffness * (reference_m - s.slow_position_m) + damping * (direction * speed - s.speed_m_s);
        return actuator_command(vented, state.loop.value_or(0) * std::clamp(force, -limit_n, limit_n));
      },
      [&](const BenchSample& s) {
        end.at_rail = direction > 0 ? s.position_m >= ends.rail_high - rail_m : s.position_m <= ends.rail_low + rail_m;
        const bool there = (to_m - s.slow_position_m) * direction <= 0.0;
        return end.at_rail || there || (s.time_s > 0.5 && s.time_s - since_s > still_s);
      });
  const std::size_t last = std::min<std::size_t>(samples.size(), 50);
  end.position_m = end.at_rail ? samples.back().position_m : mean_of(samples, samples.size() - last).position_m;
  return end;
}

/// What the low stop says of the sensor: it alone does not tell a gain from an offset.
std::string scale_finding(double low_m, double expected_m, double high_m, bool high_at_rail, const SensorBounds& ends) {
  const double middle = (ends.rail_low + ends.rail_high) / 2;
  const double gain = (middle - low_m) / (middle - expected_m), offset_m = low_m - expected_m;
  return fmt::format(
      "the position's gain or zero is wrong: {:.1f} mm at the low stop, which is at {:.1f} mm, and {:.1f} mm{} at the "
      "high one: a gain of {:.2f} about the converter's middle, or {:+.1f} mm everywhere; a ruler tells (step "
      "position)",
      1e3 * low_m, 1e3 * expected_m, 1e3 * high_m, high_at_rail ? ", the converter's end," : "", gain, 1e3 * offset_m);
}

}  // namespace

void motor_step(CommissionState& state, StepOutcome& out) {
  constexpr double from_n = 1.0, rate_n_s = 8.0, most_n = 7.0, at_most_s = 1.2;
  if (holds_pressure(state)) {
    out.verdict = StepVerdict::skipped;
    out.note = "a chamber reads pressure with every coil off: the motor would push against it";
    return;
  }
  double start_m = 0.0, force = 0.0;
  const BenchGuard guard{0.015, no_pressure_bound};
  const double before_m =
      mean_of(state.bench.play(0.1, guard, [](const BenchSample&) { return Command{}; }), 5).position_m;
  const auto samples = state.bench.play(
      at_most_s, guard,
      [&](const BenchSample& s) {
        if (s.time_s == 0.0) start_m = before_m;
        force = std::min(from_n + rate_n_s * s.time_s, most_n);
        return actuator_command(0, force);
      },
      [&](const BenchSample& s) { return std::abs(s.slow_position_m - start_m) > moved_m; });
  const double moved = samples.back().slow_position_m - start_m;
  const int direction = moved > seen_m ? 1 : moved < -seen_m ? -1 : 0;
  state.seen.motor = state.loop = direction;
  const double at_m = samples.back().slow_position_m;
  state.bench.play(0.4, {0.03, no_pressure_bound},
                   [&](const BenchSample& s) { return actuator_command(0, hold_force_n(state, s, at_m)); });
  out.measured = {{"direction", static_cast<double>(direction), "", 1.0, 1.0},
                  {"force_when_moved", force, "N", 0.3, 6.0}};
  if (direction == 0) out.findings.push_back(fmt::format("the motor does not move the slide with {:.0f} N", most_n));
  if (direction < 0)
    out.findings.emplace_back(
        "the position falls when the motor should raise it: the motor has the wrong sign or the position sensor is "
        "inverted; step coils tells which");
}

void end_stops_step(CommissionState& state, StepOutcome& out) {
  const bool horizontal = state.settings.plane == Plane::horizontal;
  if (!horizontal || !state.wiring_is_known) {
    out.verdict = StepVerdict::skipped;
    out.note = horizontal ? "step coils has not passed"
                          : "the motor is too weak upright: do step position by hand, or lay the arm flat";
    return;
  }
  const ActuatorParameters& p = state.nominal;
  const SensorBounds& ends = state.settings.plausibility.channels[position_channel];
  constexpr double longest_s = 8.0, beyond_m = 1.0;
  const CreepEnd low = creep(state, -1.0, -beyond_m, longest_s);
  const CreepEnd high = creep(state, 1.0, beyond_m, longest_s);
  creep(state, -1.0, (p.position_min_m() + p.position_max_m()) / 2, longest_s);
  let_rest(state, CoilPatterns(state.three_way).exhaust_both(), {1.0, no_pressure_bound});
  const double low_at = std::max(p.position_min_m(), ends.rail_low),
               high_at = std::min(p.position_max_m(), ends.rail_high);
  const double low_band = stop_band_m, high_from = high_at - stop_band_m;
  out.measured = {{"low_stop", 1e3 * low.position_m, "mm", 1e3 * (low_at - low_band), 1e3 * (low_at + low_band)},
                  {"high_stop", 1e3 * high.position_m, "mm", 1e3 * high_from, 1e3 * (high_at + stop_band_m)},
                  {"limit_low", 1e3 * state.settings.position_low_m, "mm", 1e3 * low.position_m, {}},
                  {"limit_high", 1e3 * state.settings.position_high_m, "mm", {}, 1e3 * high.position_m}};
  const bool low_good = std::abs(low.position_m - low_at) <= low_band;
  if (low_good && out.measured[1].good()) return;
  if (low_good && !high.at_rail)
    out.findings.push_back(fmt::format(
        "the slide stops at {:.1f} mm: something blocks it, or the position's gain is wrong", 1e3 * high.position_m));
  else
    out.findings.push_back(scale_finding(low.position_m, low_at, high.position_m, high.at_rail, ends));
}

}  // namespace solenoid
