#pragma once

#include "core/rt/recorder.hpp"
#include "experiments/campaign/scenario.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

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

/// A run over time as reports draw it: small enough that a campaign keeps every tick of every run.
///
/// name       unit  resolution
/// reference  m     1e-7        desired position
/// position   m     1e-7        the true one; where nobody knows it, the measured one
/// pressure_a, pressure_b  Pa  10
/// mode       -     1           index into `modes`, -1: a pattern without a name
/// motor      N     1e-3        written, after the limits
///
/// An overview has in place of ticks spans of equal duration, two samples each, and also
/// error      m     1e-7        reference - position
/// cylinder   N     1e-3        force of the cylinder on the slide
struct Trace {
  struct Signal {
    std::string name, unit;
    double resolution = 1.0;
    std::vector<double> values;  ///< one a sample; NaN where the state had left the numbers
  };
  double tick_s = 0.001;
  std::vector<std::int64_t> ticks;  ///< of each sample, since the run began; increasing
  std::vector<Signal> signals;
  std::vector<std::string> modes;
  /// Cylinder force = [0] + [1] p_A + [2] p_B [N, Pa] of the plant in (4.3).
  std::array<double, 3> cylinder_force{};
  double motor_limit_n = 0.0;
  bool measured = false;  ///< position and pressures are measurements
  SolveHistogram solves;

  const Signal& signal(std::string_view name) const;  ///< throws std::out_of_range
};

Trace make_trace(const VariantConfig& variant, const ScenarioConfig& scenario, std::span<const TickRecord> ticks);

/// The same run in `spans` spans: of each signal the lowest and the highest value of each span, in their order of time.
/// No peak is lost. A run of no more ticks than that keeps each of them.
Trace overview(const Trace& trace, int spans);

/// Ticks that have what `draw_figure` draws, and nothing else.
std::vector<TickRecord> ticks_of(const Trace& trace, const ModeSet& modes);

/// A trace as bytes. Every number is rounded to its signal's resolution.
///
///   "SLT1", then deflated (RFC 1950):
///   header length [4 bytes, little endian], JSON header, columns
///
/// A column is the number of its steps, value / resolution rounded, as LEB128 of the zigzag of their first or second
/// differences ("order" in the header); 2^46 stands for what is no number. The first column, `tick`, has resolution 1.
std::string encode_trace(const Trace& trace);
/// The inverse. Throws std::invalid_argument for what is no such bytes.
Trace decode_trace(std::string_view bytes);

}  // namespace solenoid
