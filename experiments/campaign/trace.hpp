#pragma once

#include "core/rt/recorder.hpp"
#include "experiments/campaign/scenario.hpp"
#include "experiments/campaign/trace_layout.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace solenoid {

/// How often solves took how long: bin i counts times from 10^(i/10) to 10^((i+1)/10) us, ten bins a decade.
struct SolveHistogram {
  static constexpr int per_decade = 10, least = -10, most = 79;  ///< 0.1 us to 100 s; what is beyond counts at the end
  int first = 0;                                                 ///< the bin of counts[0]
  std::vector<std::int64_t> counts;                              ///< without empty bins at either end

  void add(double time_us);
  void add(const SolveHistogram& other);
  std::int64_t total() const;

 private:
  std::int64_t& count_of(int bin);
};

/// Of a run's solves.
SolveHistogram solves_of(std::span<const TickRecord> ticks);

/// A run over time as reports draw it: small enough that a campaign keeps every tick of every run. What is kept, what is
/// made of it and how it is drawn are its system's (TraceLayout), and go with it: whoever draws a trace knows no system.
///
/// An overview has in place of ticks spans of equal duration, two samples each, and the derived signals beside the kept
/// ones.
struct Trace {
  struct Signal {
    std::string name, unit;
    double resolution = 1.0;
    std::vector<double> values;  ///< one a sample; NaN where the state had left the numbers
  };
  double tick_s = 0.001;
  std::vector<std::int64_t> ticks;  ///< of each sample, since the run began; increasing
  std::vector<Signal> signals;      ///< TraceLayout::kept, in its order
  std::vector<TraceLayout::Derived> derived;
  std::vector<TraceLayout::Panel> panels;
  std::vector<std::string> modes;  ///< which the signal of a panel of modes counts
  bool measured = false;           ///< states are measurements: nobody knows the true ones
  SolveHistogram solves;

  bool has(std::string_view name) const;              ///< among `signals`
  const Signal& signal(std::string_view name) const;  ///< throws std::out_of_range
};

/// What a system keeps of a run. The variant need not have been told of the scenario.
Trace make_trace(const VariantConfig& variant, const ScenarioConfig& scenario, std::span<const TickRecord> ticks);

/// The same run with its derived signals among the others.
Trace with_derived(Trace trace);

/// The same run in `spans` spans: of each signal, derived ones too, the lowest and the highest value of each span, in
/// their order of time. No peak is lost. A run of no more ticks than that keeps each of them.
Trace overview(const Trace& trace, int spans);

/// What a trace says beside its numbers, as a page reads it.
///
///   samples, tick_s, modes, measured
///   derived   [{name, unit, resolution, constant, terms: [[SIGNAL, factor], ...]}]
///   panels    [{label, unit, scale, curves: [{signal, label, desired}], modes, zero, limit, choice}]
///   solves    {first, counts}
nlohmann::ordered_json trace_header(const Trace& trace);

/// A trace as bytes. Every number is rounded to its signal's resolution.
///
///   "SLT2", then deflated (RFC 1950):
///   header length [4 bytes, little endian], JSON header, columns
///
/// The header is trace_header() and `columns`: [{name, unit, resolution, order, bytes}].
/// A column is the number of its steps, value / resolution rounded, as LEB128 of the zigzag of their first or second
/// differences ("order" in the header); 2^46 stands for what is no number. The first column, `tick`, has resolution 1.
std::string encode_trace(const Trace& trace);
/// The inverse; also of "SLT1", the format before, in which one system's signals were written into the program. Throws
/// std::invalid_argument for what is no such bytes.
Trace decode_trace(std::string_view bytes);

}  // namespace solenoid
