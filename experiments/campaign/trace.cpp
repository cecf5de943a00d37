#include "experiments/campaign/trace.hpp"

#include "experiments/campaign/simulated_system.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace solenoid {
namespace {

/// A rig reports no true state: all of them are zero then, in every tick.
bool knows_truth(std::span<const TickRecord> ticks, std::size_t states) {
  return std::ranges::any_of(ticks, [&](const TickRecord& t) {
    const std::span<const double> truth = std::span(t.sensors.truth).first(states);
    return std::ranges::any_of(truth, [](double value) { return value != 0.0; });
  });
}

/// A tick's record at the place where a layout has the signal.
double kept_value(const TickRecord& tick, const TraceLayout::Kept& kept, const ModeSet& modes, bool measured) {
  switch (kept.source) {
    case TraceLayout::Source::reference:
      return tick.decision.reference.axis[kept.index].value;
    case TraceLayout::Source::mode:
      return double(modes.find(tick.applied.switches));
    case TraceLayout::Source::continuous:
      return tick.applied.continuous[kept.index];
    case TraceLayout::Source::state:
      break;
  }
  return measured ? tick.sensors.value[kept.channel] : tick.sensors.truth[kept.index];
}

std::vector<std::int64_t> tick_numbers(std::span<const TickRecord> ticks, double tick_s) {
  std::vector<std::int64_t> numbers;
  numbers.reserve(ticks.size());
  for (const TickRecord& tick : ticks) numbers.push_back(std::llround(tick.sensors.time_s / tick_s));
  return numbers;
}

Trace::Signal derived_signal(const Trace& trace, const TraceLayout::Derived& derived) {
  Trace::Signal sum{derived.name, derived.unit, derived.resolution, {}};
  sum.values.assign(trace.ticks.size(), derived.constant);
  for (const auto& [name, factor] : derived.terms) {
    const std::vector<double>& values = trace.signal(name).values;
    for (std::size_t i = 0; i < sum.values.size(); ++i) sum.values[i] += factor * values[i];
  }
  return sum;
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

bool Trace::has(std::string_view name) const { return std::ranges::count(signals, name, &Signal::name) > 0; }

const Trace::Signal& Trace::signal(std::string_view name) const {
  const auto found = std::ranges::find(signals, name, &Signal::name);
  if (found == signals.end()) throw std::out_of_range("no signal " + std::string(name));
  return *found;
}

SolveHistogram solves_of(std::span<const TickRecord> ticks) {
  SolveHistogram solves;
  for (const TickRecord& t : ticks)
    if (t.decision.solved) solves.add(t.decision.report.time_us);
  return solves;
}

Trace make_trace(const VariantConfig& chosen, const ScenarioConfig& scenario, std::span<const TickRecord> ticks) {
  const VariantConfig variant = told(chosen, scenario);
  const System& system = system_of(variant);
  const ModeSet modes = system.modes(variant);
  TraceLayout layout = simulation_of(scenario).layout(variant, scenario);
  Trace trace;
  trace.tick_s = variant.timing.tick_s;
  trace.ticks = tick_numbers(ticks, trace.tick_s);
  trace.measured = !knows_truth(ticks, system.description().states.size());
  for (const Mode& mode : modes.modes()) trace.modes.push_back(mode.name);
  for (const TraceLayout::Kept& kept : layout.kept) {
    Trace::Signal& signal = trace.signals.emplace_back(Trace::Signal{kept.name, kept.unit, kept.resolution, {}});
    signal.values.reserve(ticks.size());
    for (const TickRecord& t : ticks) signal.values.push_back(kept_value(t, kept, modes, trace.measured));
  }
  trace.derived = std::move(layout.derived);
  trace.panels = std::move(layout.panels);
  trace.solves = solves_of(ticks);
  return trace;
}

Trace with_derived(Trace trace) {
  for (const TraceLayout::Derived& derived : trace.derived)
    if (!trace.has(derived.name)) trace.signals.push_back(derived_signal(trace, derived));
  return trace;
}

Trace overview(const Trace& trace, int spans) {
  Trace result = with_derived(trace);
  if (trace.ticks.size() <= 2 * static_cast<std::size_t>(spans)) return result;
  const std::vector<std::size_t> begins = span_begins(trace, spans);
  std::vector<std::int64_t> ticks;
  ticks.reserve(2 * static_cast<std::size_t>(spans));
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

}  // namespace solenoid
