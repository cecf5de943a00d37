#include "experiments/systems/actuator/identify/log_source.hpp"

#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/files.hpp"
#include "experiments/rig/log/recorded_run.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

const std::vector<std::string> numbers = {"time_s", "position_m", "pressure_a_pa", "pressure_b_pa", "motor_n", "coils"};
constexpr std::size_t fewest = 200;

/// Where a number of ours is: a column of the file, times a factor.
struct Source {
  std::string column;
  double factor = 1.0;
};

std::map<std::string, Source> parse_columns(const std::vector<std::string>& texts) {
  std::map<std::string, Source> sources;
  for (const std::string& text : texts) {
    const auto equals = text.find('=');
    const std::string name = text.substr(0, equals);
    if (equals == std::string::npos || (name != "label" && std::ranges::find(numbers, name) == numbers.end()))
      throw ConfigError(
          fmt::format("--column '{}': (allowed: NAME=COLUMN or NAME=COLUMN*FACTOR with NAME one of {}, label)", text,
                      fmt::join(numbers, ", ")));
    Source source{text.substr(equals + 1), 1.0};
    if (const auto star = source.column.rfind('*'); star != std::string::npos) {
      const std::string factor = source.column.substr(star + 1);
      const auto end = std::from_chars(factor.data(), factor.data() + factor.size(), source.factor);
      if (end.ec != std::errc() || end.ptr != factor.data() + factor.size() || !std::isfinite(source.factor))
        throw ConfigError(fmt::format("--column '{}': '{}' is no number (allowed: NAME=COLUMN*FACTOR)", text, factor));
      source.column.resize(star);
    }
    sources[name] = source;
  }
  return sources;
}

std::vector<std::string> cells_of(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  std::vector<std::string> cells;
  std::size_t from = 0;
  for (std::size_t at = 0; at <= line.size(); ++at)
    if (at == line.size() || line[at] == ',') {
      cells.push_back(line.substr(from, at - from));
      from = at + 1;
    }
  return cells;
}

/// The rows as they are in the file.
struct Samples {
  std::vector<double> time, position, a, b, motor;
  std::vector<SwitchPattern> coils;
  std::vector<std::string> labels;

  void spans_of(Record& record) const {
    for (std::size_t i = 0; i < labels.size(); ++i)
      if (i == 0 || labels[i] != labels[i - 1])
        record.spans.push_back({labels[i].substr(0, labels[i].find('#')), i, i + 1});
      else
        record.spans.back().last = i + 1;
  }
};

/// Brings samples to an even period. Already even ones pass untouched, with their labels.
void resample(const Samples& s, const std::string& path, Record& record) {
  if (s.time.size() < fewest)
    throw ConfigError(fmt::format("{}: {} samples (allowed: at least {})", path, s.time.size(), fewest));
  std::vector<double> steps;
  for (std::size_t i = 1; i < s.time.size(); ++i) steps.push_back(s.time[i] - s.time[i - 1]);
  std::ranges::nth_element(steps, steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2));
  const double period = 1e-6 * std::round(1e6 * steps[steps.size() / 2]);
  if (!(period >= 1e-4 && period <= 5e-3))
    throw ConfigError(fmt::format("{}: a sample each {:.3g} s (allowed: 0.1 to 5 ms)", path, period));
  record.period_s = period;
  const auto n = static_cast<std::size_t>(std::llround((s.time.back() - s.time.front()) / period)) + 1;
  const bool even = n == s.time.size() && std::ranges::all_of(steps, [&](double d) { return d < 1.5 * period; });
  if (n > 4'000'000) throw ConfigError(fmt::format("{}: {} samples (allowed: at most 4000000)", path, n));
  std::size_t i = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const double t = s.time.front() + static_cast<double>(k) * period;
    if (even)
      i = k;
    else
      while (i + 1 < s.time.size() && s.time[i + 1] <= t + 1e-9) ++i;
    const std::size_t next = std::min(i + 1, s.time.size() - 1);
    const double gap = s.time[next] - s.time[i];
    const double share = even || gap <= 0 ? 0.0 : std::clamp((t - s.time[i]) / gap, 0.0, 1.0);
    const auto line = [&](const std::vector<double>& x) { return x[i] + share * (x[next] - x[i]); };
    record.position_m.push_back(line(s.position));
    record.pressure_a_pa.push_back(line(s.a));
    record.pressure_b_pa.push_back(line(s.b));
    record.motor_n.push_back(s.motor[i]);
    record.coils.push_back(s.coils[i]);
    if (gap > 1.5 * period && share > 0.01) ++record.filled;
  }
  if (even) s.spans_of(record);
}

Record record_from_mcap(const std::string& path, const LogSettings& settings) {
  const RecordedRun run = read_run(path);
  Samples s;
  for (const TickRecord& tick : run.ticks) {
    if (!s.time.empty() && !(tick.sensors.time_s > s.time.back())) continue;
    s.time.push_back(tick.sensors.time_s);
    s.position.push_back(tick.sensors.value[position_channel]);
    s.a.push_back(tick.sensors.value[pressure_a_channel]);
    s.b.push_back(tick.sensors.value[pressure_b_channel]);
    s.motor.push_back(tick.applied.continuous[0]);
    s.coils.push_back(tick.applied.switches);
  }
  Record record;
  record.valves = settings.valves;
  record.plane = settings.plane;
  resample(s, path, record);
  return record;
}

/// A CSV: perhaps a line about its record, a heading, rows.
class CsvLog {
 public:
  CsvLog(const std::string& text, const std::string& path, const LogSettings& settings)
      : in_(text), path_(path), sources_(parse_columns(settings.columns)) {
    record_.valves = settings.valves;
    record_.plane = settings.plane;
  }

  Record read() {
    read_about();
    read_heading();
    while (next_line())
      if (!line_.empty() && line_ != "\r") read_row();
    resample(samples_, path_, record_);
    return std::move(record_);
  }

 private:
  bool next_line() {
    ++number_;
    return static_cast<bool>(std::getline(in_, line_));
  }
  [[noreturn]] void fail(const std::string& problem) const {
    throw ConfigError(fmt::format("{}:{}: {}", path_, number_, problem));
  }

  /// What record_csv says about its record.
  void read_about() {
    while (next_line() && line_.starts_with("# ")) {
      std::istringstream words(line_.substr(2));
      for (std::string word; words >> word;) {
        const auto equals = word.find('=');
        const std::string key = word.substr(0, equals),
                          value = equals == std::string::npos ? "" : word.substr(equals + 1);
        if (key == "experiment") record_.name = value;
        if (key == "plane") record_.plane = value == "vertical" ? Plane::vertical : Plane::horizontal;
        if (key == "valves") record_.valves = value;
        if (key == "payload_kg") record_.payload_kg = std::atof(value.c_str());
      }
    }
  }

  void read_heading() {
    heading_ = cells_of(line_);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const auto place = place_of(numbers[i]);
      if (!place)
        fail(fmt::format("no column '{}' (allowed: a heading with {}; or --column {}=ONE OF {})", column_of(numbers[i]),
                         fmt::join(numbers, ", "), numbers[i], fmt::join(heading_, ", ")));
      places_.push_back(*place);
      factors_.push_back(sources_.contains(numbers[i]) ? sources_.at(numbers[i]).factor : 1.0);
    }
    label_ = place_of("label");
  }
  std::string column_of(const std::string& name) const {
    const auto source = sources_.find(name);
    return source == sources_.end() ? name : source->second.column;
  }
  std::optional<std::size_t> place_of(const std::string& name) const {
    const auto at = std::ranges::find(heading_, column_of(name));
    if (at == heading_.end()) return std::nullopt;
    return static_cast<std::size_t>(at - heading_.begin());
  }

  void read_row() {
    const std::vector<std::string> cells = cells_of(line_);
    if (cells.size() != heading_.size())
      fail(fmt::format("{} cells (allowed: {}, as in the heading)", cells.size(), heading_.size()));
    std::vector<double> v;
    for (std::size_t i = 0; i < numbers.size(); ++i)
      v.push_back(factors_[i] * number_in(cells[places_[i]], heading_[places_[i]]));
    const double coils = v[5];
    if (coils < 0 || coils > 255 || coils != std::floor(coils))
      fail(fmt::format("coils {} (allowed: a whole number, a bit a coil)", coils));
    if (!samples_.time.empty() && !(v[0] > samples_.time.back()))
      fail(fmt::format("time {} s after {} s (allowed: times that increase)", v[0], samples_.time.back()));
    samples_.time.push_back(v[0]);
    samples_.position.push_back(v[1]);
    samples_.a.push_back(v[2]);
    samples_.b.push_back(v[3]);
    samples_.motor.push_back(v[4]);
    samples_.coils.push_back(static_cast<SwitchPattern>(coils));
    if (label_) samples_.labels.push_back(cells[*label_]);
  }
  double number_in(const std::string& cell, const std::string& column) const {
    double value = 0;
    const auto end = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (end.ec != std::errc() || end.ptr != cell.data() + cell.size() || !std::isfinite(value))
      fail(fmt::format("column '{}': '{}' is no number (allowed: a number)", column, cell));
    return value;
  }

  std::istringstream in_;
  std::string path_, line_;
  std::map<std::string, Source> sources_;
  int number_ = 0;
  std::vector<std::string> heading_;
  std::vector<std::size_t> places_;
  std::vector<double> factors_;
  std::optional<std::size_t> label_;
  Samples samples_;
  Record record_;
};

}  // namespace

Record record_from_csv(const std::string& text, const std::string& path, const LogSettings& settings) {
  return CsvLog(text, path, settings).read();
}

Record read_log_record(const std::string& path, const LogSettings& settings) {
  Record record;
  if (path.ends_with(".csv")) {
    const auto text = read_whole_file(path);
    if (!text) throw ConfigError(fmt::format("{}: cannot be read (allowed: a CSV, or an MCAP log of `run`)", path));
    record = record_from_csv(*text, path, settings);
  } else {
    record = record_from_mcap(path, settings);
  }
  if (record.name.empty()) record.name = std::filesystem::path(path).stem().string();
  return record;
}

std::string record_csv(const Record& r) {
  std::string text = fmt::format("# experiment={} plane={} valves={} payload_kg={}\n", r.name,
                                 r.plane == Plane::vertical ? "vertical" : "horizontal", r.valves, r.payload_kg);
  text += "time_s,position_m,pressure_a_pa,pressure_b_pa,motor_n,coils,label\n";
  std::size_t span = 0;
  for (std::size_t t = 0; t < r.size(); ++t) {
    while (span < r.spans.size() && t >= r.spans[span].last) ++span;
    // A number behind each label keeps spans apart that follow each other.
    const bool inside = span < r.spans.size() && t >= r.spans[span].first;
    fmt::format_to(std::back_inserter(text), "{:.6f},{},{},{},{},{},", r.period_s * static_cast<double>(t),
                   r.position_m[t], r.pressure_a_pa[t], r.pressure_b_pa[t], r.motor_n[t], r.coils[t]);
    if (inside) fmt::format_to(std::back_inserter(text), "{}#{}", r.spans[span].label, span);
    text += '\n';
  }
  return text;
}

}  // namespace solenoid
