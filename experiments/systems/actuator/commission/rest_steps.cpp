#include "core/metrics/metrics.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/systems/actuator/commission/steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double atmosphere_band_pa = 12e3;  // weather, height and the sensor's zero
constexpr double stop_band_m = 1.5e-3;

/// Deviation and converter step of a channel at rest.
struct Quiet {
  double mean = 0.0, sigma = 0.0, quantum = 0.0;
};
Quiet quiet_of(std::vector<double> values) {
  Quiet q;
  for (const double v : values) q.mean += v / static_cast<double>(values.size());
  for (const double v : values) q.sigma += (v - q.mean) * (v - q.mean) / static_cast<double>(values.size());
  q.sigma = std::sqrt(q.sigma);
  std::ranges::sort(values);
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double gap = values[i] - values[i - 1];
    if (gap > 1e-9 * std::abs(values[i]) && (q.quantum == 0.0 || gap < q.quantum)) q.quantum = gap;
  }
  return q;
}

/// None: more than nothing, and less than a supply would make it.
Answer against(double value, double zero) {
  constexpr double supplied_pa = 40e3;
  if (std::abs(value - zero) <= atmosphere_band_pa) return 0;
  if (std::abs(value - zero) < supplied_pa) return std::nullopt;
  return value > zero ? 1 : -1;
}

}  // namespace

BenchMean mean_of(const std::vector<BenchSample>& samples, std::size_t first) {
  BenchMean mean;
  const auto count = static_cast<double>(samples.size() - first);
  for (std::size_t i = first; i < samples.size(); ++i) {
    mean.position_m += samples[i].position_m / count;
    for (const std::size_t k : {0u, 1u}) mean.pressure_pa[k] += samples[i].pressure_pa[k] / count;
  }
  return mean;
}

bool holds_pressure(CommissionState& state) {
  const BenchGuard free{1.0, std::numeric_limits<double>::infinity()};
  const BenchMean mean = mean_of(state.bench.play(0.1, free, [](const BenchSample&) { return Command{}; }), 5);
  const double atmosphere = state.nominal.atmospheric_pressure_pa;
  return std::abs(mean.pressure_pa[0] - atmosphere) > atmosphere_band_pa ||
         std::abs(mean.pressure_pa[1] - atmosphere) > atmosphere_band_pa;
}

double hold_force_n(const CommissionState& state, const BenchSample& s, double centre_m, double limit_n) {
  constexpr double stiffness = 600.0, damping = 150.0;
  if (!state.loop || *state.loop == 0) return 0.0;
  return *state.loop *
         std::clamp(stiffness * (centre_m - s.slow_position_m) - damping * s.speed_m_s, -limit_n, limit_n);
}

void let_rest(CommissionState& state, SwitchPattern coils, const BenchGuard& guard) {
  constexpr double band_m = 0.15e-3, still_s = 0.1, at_most_s = 1.5;
  double low = 0.0, high = 0.0, since_s = 0.0;
  state.bench.play(
      at_most_s, guard,
      [&](const BenchSample& s) {
        if (s.time_s == 0.0 || s.slow_position_m > low + band_m || s.slow_position_m < high - band_m)
          low = high = s.slow_position_m, since_s = s.time_s;
        low = std::min(low, s.slow_position_m);
        high = std::max(high, s.slow_position_m);
        return actuator_command(coils, hold_force_n(state, s, s.slow_position_m));
      },
      [&](const BenchSample& s) { return s.time_s - since_s > still_s; });
}

bool asked_and_done(CommissionState& state, const std::string& what) {
  const Operator& beside = state.settings.beside;
  if (!beside.present) return false;
  constexpr double at_most_s = 600.0;
  const BenchGuard free{1.0, std::numeric_limits<double>::infinity()};
  for (;;) {
    beside.ask(what + ", then Enter (s: leave it out, q: end) ");
    std::optional<std::string> line;
    state.bench.play(
        at_most_s, free, [](const BenchSample&) { return Command{}; },
        [&](const BenchSample&) { return (line = beside.answer()).has_value(); });
    if (!line || *line == "s") return false;
    if (line->empty()) return true;
    if (*line == "q") throw BenchInterrupted("ended by the operator");
  }
}

void link_step(CommissionState& state, StepOutcome& out) {
  constexpr int ticks = 200;
  std::vector<double> read_us;
  int missed = 0;
  const BenchGuard free{1.0, std::numeric_limits<double>::infinity()};
  state.bench.play(ticks * state.bench.tick_s(), free, [&](const BenchSample& s) {
    read_us.push_back(s.read_us);
    missed += s.fresh ? 0 : 1;
    return Command{};
  });
  const Percentiles p = percentiles(read_us);
  const double left_out = ticks - static_cast<double>(read_us.size());
  out.measured = {{"read_p99", p.p99, "us", {}, 1e6 * state.bench.tick_s()},
                  {"read_max", p.max, "us"},
                  {"missed", 100.0 * missed / ticks, "%", {}, 2.0},
                  {"ticks_left_out", left_out, ""}};
}

void sensors_step(CommissionState& state, StepOutcome& out) {
  constexpr double settle_s = 0.5, seconds = 0.5;
  const BenchGuard free{1.0, std::numeric_limits<double>::infinity()};
  state.bench.play(settle_s, free, [](const BenchSample&) { return Command{}; });
  const auto samples = state.bench.play(seconds, free, [](const BenchSample&) { return Command{}; });
  constexpr std::size_t first = 5;  // values from before this step
  std::array<std::vector<double>, 3> values;
  for (std::size_t i = first; i < samples.size(); ++i) {
    values[0].push_back(samples[i].position_m);
    values[1].push_back(samples[i].pressure_pa[0]);
    values[2].push_back(samples[i].pressure_pa[1]);
  }
  const std::array<Quiet, 3> quiet = {quiet_of(values[0]), quiet_of(values[1]), quiet_of(values[2])};
  const SensorBounds& ends = state.settings.plausibility.channels[position_channel];
  out.measured = {{"position", 1e3 * quiet[0].mean, "mm", 1e3 * ends.rail_low, 1e3 * ends.rail_high},
                  {"position_noise", 1e3 * quiet[0].sigma, "mm", {}, 0.2},
                  {"position_quantum", 1e3 * quiet[0].quantum, "mm"}};
  const double atmosphere = state.nominal.atmospheric_pressure_pa;
  for (const std::size_t k : {0u, 1u}) {
    const Quiet& q = quiet[k + 1];
    const std::string name = k == 0 ? "pressure_a" : "pressure_b";
    const Answer rest = against(q.mean, atmosphere);
    out.measured.push_back(
        {name, 1e-3 * (q.mean - atmosphere), "kPa gauge", -1e-3 * atmosphere_band_pa, 1e-3 * atmosphere_band_pa});
    out.measured.push_back({name + "_noise", 1e-3 * q.sigma, "kPa", {}, 1.5});
    out.measured.push_back({name + "_quantum", 1e-3 * q.quantum, "kPa"});
    if (rest) out.measured.push_back({name + "_at_rest", static_cast<double>(*rest), ""});
    if (rest != Answer(0))
      out.findings.push_back(fmt::format(
          "pressure {} reads {:.0f} kPa gauge with every coil off: {}", k == 0 ? 'A' : 'B',
          1e-3 * (q.mean - atmosphere),
          state.three_way
              ? "supply and exhaust are swapped at its valve, the coil is stuck, or the sensor is wrong"
              : "vent it; if it comes back, its supply valve is stuck open or leaks, or the sensor is wrong"));
  }
  if (quiet[0].sigma == 0.0 && quiet[1].sigma == 0.0 && quiet[2].sigma == 0.0)
    out.note = "no sensor shows any noise: is the node measuring?";
}

void position_step(CommissionState& state, StepOutcome& out) {
  const auto reading = [&] {
    const BenchGuard free{1.0, std::numeric_limits<double>::infinity()};
    return mean_of(state.bench.play(0.2, free, [](const BenchSample&) { return Command{}; }), 5).position_m;
  };
  out.verdict = StepVerdict::skipped;
  out.note = "needs a hand: step end_stops lets the motor do it";
  const bool low_done = asked_and_done(state, "move the slide by hand to the low end stop (chamber A empty)");
  const double low_m = low_done ? reading() : 0.0;
  if (!low_done || !asked_and_done(state, "move it to the high end stop (chamber B empty)")) return;
  const double high_m = reading();
  out.verdict = StepVerdict::passed;
  out.note.clear();
  const ActuatorParameters& p = state.nominal;
  const SensorBounds& ends = state.settings.plausibility.channels[position_channel];
  const double low_at = std::max(p.position_min_m(), ends.rail_low),
               high_at = std::min(p.position_max_m(), ends.rail_high);
  const int direction = high_m > low_m ? 1 : -1;
  state.seen.by_hand = direction;
  out.measured = {{"direction", static_cast<double>(direction), "", 1.0, 1.0},
                  {"low_stop", 1e3 * low_m, "mm", 1e3 * (low_at - stop_band_m), 1e3 * (low_at + stop_band_m)},
                  {"high_stop", 1e3 * high_m, "mm", 1e3 * (high_at - stop_band_m), 1e3 * (high_at + stop_band_m)}};
  if (direction < 0) out.findings.emplace_back("the position sensor is inverted");
  const double gain = (high_m - low_m) / (high_at - low_at);
  if (direction > 0 && std::abs(gain - 1.0) > 2 * stop_band_m / (high_at - low_at))
    out.findings.push_back(fmt::format("the position's gain is wrong: {:.3f} of what it should be", gain));
}

void identify_step(CommissionState& state, StepOutcome& out) {
  out.verdict = StepVerdict::skipped;
  out.note = "takes minutes, run it next: " + state.settings.identify_command;
}

void motion_step(CommissionState& state, StepOutcome& out) {
  if (!state.settings.motion) {
    out.verdict = StepVerdict::skipped;
    out.note = "nobody here makes a motion";
    return;
  }
  if (!state.wiring_is_known) {
    out.verdict = StepVerdict::skipped;
    out.note = "step coils has not passed";
    return;
  }
  if (state.settings.beside.present && !asked_and_done(state, "clear the arm's sweep for the first motion")) {
    out.verdict = StepVerdict::skipped;
    out.note = "left out";
    return;
  }
  state.bench.safe();
  const MotionOutcome motion = state.settings.motion(state.bench.plant());
  if (std::isfinite(motion.rmse_mm) && std::isfinite(motion.largest_mm))
    out.measured = {{"rmse", motion.rmse_mm, "mm", {}, 5.0}, {"largest_error", motion.largest_mm, "mm"}};
  if (!motion.clean) out.findings.push_back("the run did not end clean: " + motion.told);
}

}  // namespace solenoid
