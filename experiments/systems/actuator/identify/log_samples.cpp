#include "experiments/systems/actuator/identify/log_samples.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::size_t fewest = 200;
constexpr double widest_bridge = 3.5;  // periods between two samples that a straight line may bridge
constexpr double late = 1.5;           // periods between two samples of which one is missing, or late
constexpr double early = 0.6;          // periods between two samples of which the first is late, or the second early
constexpr double jitter = 0.25;        // periods from a sample to its place among even ones that change nothing
constexpr std::size_t most_told_gaps = 3;  // one by one

/// Samples [first, last) without a gap.
struct Part {
  std::size_t first, last;
};

/// The mean of the steps about the commonest one; a whole number of microseconds where a clock's 100 ppm make it one.
double usual_step(const LogSamples& s, const std::string& path) {
  std::vector<double> steps;
  steps.reserve(s.size());
  for (std::size_t i = 1; i < s.size(); ++i) steps.push_back(s.time[i] - s.time[i - 1]);
  std::ranges::nth_element(steps, steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2));
  const double median = steps[steps.size() / 2];
  double sum = 0;
  std::size_t count = 0;
  for (const double step : steps)
    if (step > early * median && step < late * median) {
      sum += step;
      ++count;
    }
  const double mean = sum / static_cast<double>(count), round = 1e-6 * std::round(1e6 * mean);
  const double period = std::abs(mean - round) < 1e-4 * mean ? round : mean;
  if (!(period >= 1e-4 && period <= 5e-3))
    throw ConfigError(fmt::format("{}: a sample each {:.3g} s (allowed: 0.1 to 5 ms)", path, period));
  return period;
}

std::vector<Part> parts_between_gaps(const LogSamples& s, double period) {
  std::vector<Part> parts = {{0, s.size()}};
  for (std::size_t i = 1; i < s.size(); ++i) {
    if (s.time[i] - s.time[i - 1] <= widest_bridge * period) continue;
    parts.back().last = i;
    parts.push_back({i, s.size()});
  }
  return parts;
}

/// Whether each sample is at its place among even ones.
bool is_even(const LogSamples& s, const Part& part, double period) {
  for (std::size_t i = part.first; i < part.last; ++i) {
    const double place = s.time[part.first] + static_cast<double>(i - part.first) * period;
    if (std::abs(s.time[i] - place) > jitter * period) return false;
  }
  return true;
}

/// Whether samples are between the places of even ones: not where some are just missing.
bool between_places(const LogSamples& s, const Part& part, double period) {
  for (std::size_t i = part.first; i < part.last; ++i) {
    const double steps = (s.time[i] - s.time[part.first]) / period;
    if (std::abs(steps - std::round(steps)) > jitter) return true;
  }
  return false;
}

/// The last sample up to `t`, not before `from`.
std::size_t last_until(double t, const LogSamples& s, const Part& part, std::size_t from) {
  while (from + 1 < part.last && s.time[from + 1] <= t) ++from;
  return from;
}

/// Row k of the record is commanded as sample `now` says, the one before as `before` says.
void add_label(const LogSamples& s, std::size_t before, std::size_t now, std::size_t k, Record& record) {
  if (now >= s.labels.size()) return;
  if (k == 0 || s.labels[now] != s.labels[before])
    record.spans.push_back({s.labels[now].substr(0, s.labels[now].find('#')), k, k + 1});
  else
    record.spans.back().last = k + 1;
}

Record even_record(const LogSamples& s, const Part& part, double period, const Record& about) {
  Record record = about;
  record.period_s = period;
  const double from = s.time[part.first];
  const bool even = is_even(s, part, period);
  const auto n = static_cast<std::size_t>(std::llround((s.time[part.last - 1] - from) / period)) + 1;
  for (auto* column : {&record.position_m, &record.pressure_a_pa, &record.pressure_b_pa, &record.motor_n})
    column->reserve(n);
  record.coils.reserve(n);
  std::size_t i = part.first, commanded = part.first;
  for (std::size_t k = 0; k < n; ++k) {
    const double t = from + static_cast<double>(k) * period;
    i = even ? part.first + k : last_until(t + 1e-9, s, part, i);
    const std::size_t next = std::min(i + 1, part.last - 1);
    const double gap = s.time[next] - s.time[i];
    const double share = even || gap <= 0 ? 0.0 : std::clamp((t - s.time[i]) / gap, 0.0, 1.0);
    const auto line = [&](const std::vector<double>& x) { return x[i] + share * (x[next] - x[i]); };
    record.position_m.push_back(line(s.position));
    record.pressure_a_pa.push_back(line(s.a));
    record.pressure_b_pa.push_back(line(s.b));
    if (gap > late * period && share > 0.01) ++record.filled;
    // A command begins at the row nearest to it: as often early as late.
    const std::size_t before = commanded;
    commanded = even ? i : last_until(t + period / 2, s, part, commanded);
    record.motor_n.push_back(s.motor[commanded]);
    record.coils.push_back(s.coils[commanded]);
    add_label(s, before, commanded, k, record);
  }
  return record;
}

}  // namespace

void LogSamples::add(double t, double position_m, double pressure_a_pa, double pressure_b_pa, double motor_n,
                     SwitchPattern pattern) {
  time.push_back(t);
  position.push_back(position_m);
  a.push_back(pressure_a_pa);
  b.push_back(pressure_b_pa);
  motor.push_back(motor_n);
  coils.push_back(pattern);
}

LogRecords even_records(const LogSamples& s, const std::string& path, const Record& about) {
  if (s.size() < fewest)
    throw ConfigError(fmt::format("{}: {} samples (allowed: at least {})", path, s.size(), fewest));
  const double period = usual_step(s, path);
  const std::vector<Part> parts = parts_between_gaps(s, period);
  LogRecords out;
  out.records.reserve(parts.size());
  std::size_t left_out = 0;
  bool uneven = false;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Part& part = parts[p];
    if (p > 0 && p <= most_told_gaps)
      out.told.push_back(
          fmt::format("nothing from {:.6g} to {:.6g} s: divided there", s.time[part.first - 1], s.time[part.first]));
    if (part.last - part.first < fewest) {
      left_out += part.last - part.first;
      continue;
    }
    uneven = uneven || between_places(s, part, period);
    out.records.push_back(even_record(s, part, period, about));
    out.records.back().part = static_cast<int>(out.records.size());
  }
  if (parts.size() > most_told_gaps + 1)
    out.told.push_back(fmt::format("{} gaps in all: divided at each", parts.size() - 1));
  if (out.records.empty())
    throw ConfigError(fmt::format("{}: {} gaps, and nowhere {} samples without one (allowed: at least {})", path,
                                  parts.size() - 1, fewest, fewest));
  if (uneven)
    out.told.push_back(fmt::format(
        "steps vary: brought to even ones of {:.4g} ms, measurements in straight lines, commands held", 1e3 * period));
  if (left_out > 0) out.told.push_back(fmt::format("{} samples between gaps left out: too few together", left_out));
  return out;
}

}  // namespace solenoid
