#include "experiments/campaign/trace.hpp"

#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace solenoid {
namespace {

constexpr double length_m = 1e-7, pressure_pa = 10.0, force_n = 1e-3;

/// A rig reports no true state; a pressure of a simulated plant is never zero.
bool knows_truth(std::span<const TickRecord> ticks) {
  return std::ranges::any_of(ticks, [](const TickRecord& t) { return t.sensors.truth[pressure_a] != 0.0; });
}

template <class Value>
std::vector<double> values_of(std::span<const TickRecord> ticks, Value value) {
  std::vector<double> values;
  values.reserve(ticks.size());
  for (const TickRecord& tick : ticks) values.push_back(value(tick));
  return values;
}

std::vector<std::int64_t> tick_numbers(std::span<const TickRecord> ticks, double tick_s) {
  std::vector<std::int64_t> numbers;
  numbers.reserve(ticks.size());
  for (const TickRecord& tick : ticks) numbers.push_back(std::llround(tick.sensors.time_s / tick_s));
  return numbers;
}

Trace::Signal error_of(const Trace& trace) {
  Trace::Signal error{"error", "m", length_m, {}};
  const auto &reference = trace.signal("reference").values, &position = trace.signal("position").values;
  for (std::size_t i = 0; i < reference.size(); ++i) error.values.push_back(reference[i] - position[i]);
  return error;
}

Trace::Signal cylinder_of(const Trace& trace) {
  Trace::Signal cylinder{"cylinder", "N", force_n, {}};
  const auto &a = trace.signal("pressure_a").values, &b = trace.signal("pressure_b").values;
  const auto& c = trace.cylinder_force;
  for (std::size_t i = 0; i < a.size(); ++i) cylinder.values.push_back(c[0] + c[1] * a[i] + c[2] * b[i]);
  return cylinder;
}

/// Where in [first, last) the lowest and highest numbers are, in order; both `last` if there is none.
std::pair<std::size_t, std::size_t> extremes(const std::vector<double>& values, std::size_t first, std::size_t last) {
  std::size_t low = last, high = last;
  for (std::size_t i = first; i < last; ++i) {
    if (std::isnan(values[i])) continue;
    if (low == last || values[i] < values[low]) low = i;
    if (high == last || values[i] > values[high]) high = i;
  }
  return std::minmax(low, high);
}

/// First sample of each of `spans` equal durations, and the end.
std::vector<std::size_t> span_begins(const Trace& trace, int spans) {
  const std::int64_t from = trace.ticks.front(), length = trace.ticks.back() + 1 - from;
  std::vector<std::size_t> begins;
  for (int s = 0; s <= spans; ++s) {
    const std::int64_t edge = from + length * s / spans;
    const auto at = std::ranges::lower_bound(trace.ticks, edge);
    begins.push_back(static_cast<std::size_t>(at - trace.ticks.begin()));
  }
  return begins;
}

}  // namespace

std::int64_t& SolveHistogram::count_of(int bin) {
  if (counts.empty()) first = bin;
  if (bin < first) {
    counts.insert(counts.begin(), static_cast<std::size_t>(first - bin), 0);
    first = bin;
  }
  const auto index = static_cast<std::size_t>(bin - first);
  if (index >= counts.size()) counts.resize(index + 1, 0);
  return counts[index];
}

void SolveHistogram::add(double time_us) {
  const double place = time_us > 0 ? std::floor(per_decade * std::log10(time_us)) : least;
  ++count_of(static_cast<int>(std::clamp(place, double{least}, double{most})));
}

void SolveHistogram::add(const SolveHistogram& other) {
  for (std::size_t i = 0; i < other.counts.size(); ++i)
    if (other.counts[i] > 0) count_of(other.first + static_cast<int>(i)) += other.counts[i];
}

std::int64_t SolveHistogram::total() const { return std::accumulate(counts.begin(), counts.end(), std::int64_t{0}); }

const Trace::Signal& Trace::signal(std::string_view name) const {
  const auto found = std::ranges::find(signals, name, &Signal::name);
  if (found == signals.end()) throw std::out_of_range("no signal " + std::string(name));
  return *found;
}

Trace make_trace(const VariantConfig& variant, const ScenarioConfig& scenario, std::span<const TickRecord> ticks) {
  const PneumaticActuator plant(scenario.mismatch.applied_to(variant.nominal));
  const ModeSet modes = valve_modes(variant.valves, variant.nominal);
  Trace trace;
  trace.tick_s = timed(variant, scenario.timing, scenario.name).timing.tick_s;
  trace.ticks = tick_numbers(ticks, trace.tick_s);
  trace.measured = !knows_truth(ticks);
  for (const Mode& mode : modes.modes()) trace.modes.push_back(mode.name);
  const double none = plant.cylinder_force(0.0, 0.0);
  trace.cylinder_force = {none, plant.cylinder_force(1.0, 0.0) - none, plant.cylinder_force(0.0, 1.0) - none};
  trace.motor_limit_n = variant.nominal.motor_force_limit_n();
  const auto add = [&](const char* name, const char* unit, double resolution, auto value) {
    trace.signals.push_back({name, unit, resolution, values_of(ticks, value)});
  };
  const auto state = [measured = trace.measured](StateIndex i, ActuatorChannel channel) {
    return [=](const TickRecord& t) { return measured ? t.sensors.value[channel] : t.sensors.truth[i]; };
  };
  add("reference", "m", length_m, [](const TickRecord& t) { return t.decision.reference.axis[0].value; });
  add("position", "m", length_m, state(position, position_channel));
  add("pressure_a", "Pa", pressure_pa, state(pressure_a, pressure_a_channel));
  add("pressure_b", "Pa", pressure_pa, state(pressure_b, pressure_b_channel));
  add("mode", "", 1.0, [&](const TickRecord& t) { return double(modes.find(t.applied.switches)); });
  add("motor", "N", force_n, [](const TickRecord& t) { return t.applied.continuous[0]; });
  for (const TickRecord& t : ticks)
    if (t.decision.solved) trace.solves.add(t.decision.report.time_us);
  return trace;
}

Trace overview(const Trace& trace, int spans) {
  Trace result = trace;
  result.signals.push_back(error_of(trace));
  result.signals.push_back(cylinder_of(trace));
  if (trace.ticks.size() <= 2 * static_cast<std::size_t>(spans)) return result;
  const std::vector<std::size_t> begins = span_begins(trace, spans);
  std::vector<std::int64_t> ticks;
  const std::int64_t from = trace.ticks.front(), length = trace.ticks.back() + 1 - from;
  for (int half = 0; half < 2 * spans; ++half) ticks.push_back(from + length * (2 * half + 1) / (4 * spans));
  for (Trace::Signal& signal : result.signals) {
    std::vector<double> reduced;
    for (std::size_t s = 0; s + 1 < begins.size(); ++s) {
      const auto [a, b] = extremes(signal.values, begins[s], begins[s + 1]);
      const double none = std::numeric_limits<double>::quiet_NaN();
      reduced.push_back(a == begins[s + 1] ? none : signal.values[a]);
      reduced.push_back(b == begins[s + 1] ? none : signal.values[b]);
    }
    signal.values = std::move(reduced);
  }
  result.ticks = std::move(ticks);
  return result;
}

std::vector<TickRecord> ticks_of(const Trace& trace, const ModeSet& modes) {
  std::vector<TickRecord> ticks(trace.ticks.size());
  const auto &reference = trace.signal("reference").values, &actual = trace.signal("position").values;
  const auto &a = trace.signal("pressure_a").values, &b = trace.signal("pressure_b").values;
  const auto &mode = trace.signal("mode").values, &motor = trace.signal("motor").values;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    TickRecord& t = ticks[i];
    t.sensors.time_s = static_cast<double>(trace.ticks[i]) * trace.tick_s;
    t.sensors.truth[position] = t.sensors.value[position_channel] = actual[i];
    t.sensors.truth[pressure_a] = t.sensors.value[pressure_a_channel] = a[i];
    t.sensors.truth[pressure_b] = t.sensors.value[pressure_b_channel] = b[i];
    t.decision.reference.axis[0].value = reference[i];
    if (mode[i] >= 0 && mode[i] < modes.size()) t.applied.switches = modes.pattern(static_cast<int>(mode[i]));
    t.applied.continuous[0] = motor[i];
  }
  return ticks;
}

}  // namespace solenoid
