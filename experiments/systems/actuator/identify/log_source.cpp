#include "experiments/systems/actuator/identify/log_source.hpp"

#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/shown_text.hpp"
#include "experiments/logs/column_source.hpp"
#include "experiments/logs/csv_layout.hpp"
#include "experiments/logs/json_series.hpp"
#include "experiments/rig/log/mcap_writer.hpp"
#include "experiments/rig/log/recorded_run.hpp"
#include "experiments/systems/actuator/identify/log_bounds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <optional>
#include <sstream>

#include <fmt/format.h>

namespace solenoid {
namespace {

enum Number : std::size_t {
  time_number,
  position_number,
  a_number,
  b_number,
  motor_number,
  coils_number,
  number_count
};

const std::vector<WantedNumber>& wanted_numbers() {
  static const std::vector<WantedNumber> wanted = {{"time_s", "time", "s"},
                                                   {"position_m", "position", "m"},
                                                   {"pressure_a_pa", "pressure_a", "Pa"},
                                                   {"pressure_b_pa", "pressure_b", "Pa"},
                                                   {"motor_n", "motor", "N"},
                                                   {"coils", "coils", ""}};
  return wanted;
}
constexpr const char* label_name = "label";
constexpr std::size_t most_samples = 4'000'000;
constexpr std::size_t most_csv_bytes = 1'000'000'000;
constexpr double longest_log_s = 1e5;

std::vector<ColumnSource> sources_of(const LogSettings& settings) {
  std::vector<std::string> names;
  names.reserve(number_count + 1);
  for (const WantedNumber& number : wanted_numbers()) names.push_back(number.name);
  names.emplace_back(label_name);
  return parse_columns(settings.columns, names);
}

const ColumnSource* source_of(const std::vector<ColumnSource>& sources, const std::string& name) {
  const auto at = std::ranges::find(sources, name, &ColumnSource::name);
  return at == sources.end() ? nullptr : &*at;
}

/// How many patterns these valves have.
double patterns_of(const std::string& valves) { return std::pow(2.0, valve_modes(valves, {}).switch_count()); }

/// Absolute pressure is never near nothing, and half the time not below the atmosphere: gauge pressure is both.
void require_absolute(const std::vector<double>& pressure, const char* name, const std::string& path) {
  constexpr double least_pa = 1e4, least_median_pa = 7e4;
  std::vector<double> sorted = pressure;
  std::ranges::sort(sorted);
  const double least = sorted.front(), median = sorted[sorted.size() / 2];
  if (least >= least_pa && median >= least_median_pa) return;
  throw ConfigError(fmt::format(
      "{}: {}: from {:.5g} Pa, half of it below {:.5g} Pa (allowed: absolute pressure, {:.0f} Pa and more; of "
      "gauge pressure: --column {}=COLUMN*FACTOR+101325)",
      path, name, least, median, least_pa, name));
}

LogRecords records_of(const LogSamples& samples, const std::string& path, const Record& about) {
  LogRecords out = even_records(samples, path, about);
  require_absolute(samples.a, "pressure_a_pa", path);
  require_absolute(samples.b, "pressure_b_pa", path);
  const auto [least, most] = std::ranges::minmax(samples.position);
  if (least == most) out.told.push_back(fmt::format("position_m is {:.6g} in every sample: is it measured?", least));
  return out;
}

/// A CSV: perhaps lines about its record, a heading, rows.
class CsvLog {
 public:
  CsvLog(const std::string& text, const std::string& path, const LogSettings& settings)
      : path_(path), sources_(sources_of(settings)) {
    about_.valves = settings.valves;
    about_.plane = settings.plane;
    layout_ = find_layout(text, path, settings.dialect,
                          [this](const std::vector<std::string>& headings) { return known_among(headings); });
  }

  LogRecords read() {
    read_about();
    patterns_ = patterns_of(about_.valves);
    find_columns();
    CsvRows rows(layout_.rows, path_, layout_.delimiter, layout_.heading_line + 1);
    while (rows.next()) read_row(rows);
    LogRecords out = records_of(samples_, path_, about_);
    if (implausible_) throw ConfigError(*implausible_);
    if (repeated_ > 0)
      told_.push_back(fmt::format("left out what says again what the row before does: {} rows", repeated_));
    out.told.insert(out.told.begin(), told_.begin(), told_.end());
    return out;
  }

 private:
  std::size_t known_among(const std::vector<std::string>& headings) const {
    return static_cast<std::size_t>(std::ranges::count_if(wanted_numbers(), [&](const WantedNumber& number) {
      return has_column(number, source_of(sources_, number.name), headings);
    }));
  }

  /// What record_csv says about its record.
  void read_about() {
    for (const std::string& comment : layout_.comments) {
      std::istringstream words(comment);
      for (std::string word; words >> word;) {
        const auto equals = word.find('=');
        if (equals == std::string::npos) continue;
        read_about(word.substr(0, equals), word.substr(equals + 1), comment);
      }
    }
  }
  void read_about(const std::string& key, const std::string& value, const std::string& comment) {
    const auto refuse = [&](const char* allowed) {
      throw ConfigError(fmt::format("{}: its line {}: {} (allowed: {})", path_, shown("#" + comment),
                                    shown(key + "=" + value), allowed));
    };
    if (key == "experiment") {
      about_.name = value;
      if (value.empty() || value.find('/') != std::string::npos) refuse("a name without a slash");
    }
    if (key == "plane") {
      if (value != "vertical" && value != "horizontal") refuse("vertical, horizontal");
      about_.plane = value == "vertical" ? Plane::vertical : Plane::horizontal;
    }
    if (key == "valves") {
      if (value != "two_way" && value != "three_way") refuse("two_way, three_way");
      about_.valves = value;
    }
    if (key == "payload_kg") {
      const auto number = number_of_cell(value, '.');
      if (!number || *number < 0 || *number > 10) refuse("0 to 10");
      about_.payload_kg = *number;
    }
  }

  void find_columns() {
    try {
      for (std::size_t i = 0; i < number_count; ++i) {
        columns_[i] = find_column(wanted_numbers()[i], source_of(sources_, wanted_numbers()[i].name), layout_.headings);
        if (!columns_[i].told.empty()) told_.push_back(columns_[i].told);
      }
      const ColumnSource* label = source_of(sources_, label_name);
      if (label || std::ranges::find(layout_.headings, label_name) != layout_.headings.end())
        label_ = find_column({label_name, label_name, ""}, label, layout_.headings).place;
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("{}:{}: {}", path_, layout_.heading_line, error.what()));
    }
    if (!layout_.told.empty()) told_.insert(told_.begin(), layout_.told);
  }

  void read_row(const CsvRows& rows) {
    const std::vector<std::string>& cells = rows.cells();
    const std::size_t expected = layout_.headings.size();
    const bool too_many = std::any_of(cells.begin() + static_cast<std::ptrdiff_t>(std::min(expected, cells.size())),
                                      cells.end(), [](const std::string& cell) { return !cell.empty(); });
    if (cells.size() < expected && rows.cut()) {
      told_.push_back(fmt::format("line {}, the last, is cut: left out", rows.line()));
      return;
    }
    if (cells.size() < expected || too_many)
      rows.fail(fmt::format("{} cells (allowed: {}, as in the heading)", cells.size(), expected));
    std::array<double, number_count> raw{}, ours{};
    for (std::size_t i = 0; i < number_count; ++i) {
      const FoundColumn& column = columns_[i];
      const auto value = number_of_cell(cells[column.place], layout_.decimal);
      if (!value)
        rows.fail(fmt::format("column {}: {} is no number (allowed: a number)", shown(layout_.headings[column.place]),
                              shown(cells[column.place])));
      raw[i] = *value;
      ours[i] = column.factor * *value + column.offset;
    }
    add(rows, raw, ours);
    if (label_ && samples_.labels.size() < samples_.size()) samples_.labels.push_back(cells[*label_]);
  }

  void add(const CsvRows& rows, const std::array<double, number_count>& raw,
           const std::array<double, number_count>& ours) {
    const double coils = ours[coils_number];
    if (!(coils >= 0 && coils < patterns_ && coils == std::floor(coils)))
      rows.fail(fmt::format("coils {} (allowed: a whole number from 0 to {}, a bit a coil of {} valves)", coils,
                            patterns_ - 1, about_.valves));
    // From the first row on, so that the digits of a clock that counts from 1970 are those of the log's own time.
    if (samples_.size() == 0) first_time_ = raw[time_number];
    const double t =
        columns_[time_number].factor * (raw[time_number] - first_time_) +
        (first_is_zero() ? 0.0 : columns_[time_number].factor * first_time_ + columns_[time_number].offset);
    const double before = samples_.size() == 0 ? t : samples_.time.back();
    if (samples_.size() > 0 && t == before && raw == last_) {
      ++repeated_;
      return;
    }
    if (samples_.size() > 0 && !(t > before && t - samples_.time.front() <= longest_log_s))
      rows.fail(fmt::format("time {} s after {} s (allowed: times that increase, {:.0f} s in all)", ours[time_number],
                            columns_[time_number].factor * last_[time_number] + columns_[time_number].offset,
                            longest_log_s));
    if (samples_.size() == most_samples) rows.fail(fmt::format("one sample more (allowed: {})", most_samples));
    last_ = raw;
    if (!implausible_) implausible_ = implausible_in(rows, ours);
    samples_.add(t, ours[position_number], ours[a_number], ours[b_number], ours[motor_number],
                 static_cast<SwitchPattern>(coils));
  }
  std::optional<std::string> implausible_in(const CsvRows& rows, const std::array<double, number_count>& ours) const {
    for (std::size_t i = 0; i < number_count; ++i)
      if (const auto why = implausible(wanted_numbers()[i].name, ours[i]))
        return fmt::format("{}:{}: {}", path_, rows.line(), *why);
    return std::nullopt;
  }
  /// Whether times are counted from the log's first, being far from it.
  bool first_is_zero() const { return std::abs(columns_[time_number].factor * first_time_) > longest_log_s; }

  std::string path_;
  std::vector<ColumnSource> sources_;
  CsvLayout layout_;
  std::array<FoundColumn, number_count> columns_;
  std::optional<std::size_t> label_;
  double patterns_ = 0, first_time_ = 0;
  std::array<double, number_count> last_{};
  std::size_t repeated_ = 0;
  std::optional<std::string> implausible_;  // the first of these; told once the log is known to be one
  std::vector<std::string> told_;
  LogSamples samples_;
  Record about_;
};

LogRecords records_from_run(const std::string& path, const LogSettings& settings) {
  const RecordedRun run = read_run(path);
  if (run.system->name != actuator_description().name)
    throw ConfigError(
        fmt::format("{}: is of the system '{}' (allowed: {})", path, run.system->name, actuator_description().name));
  const double patterns = patterns_of(settings.valves);
  LogSamples samples;
  for (const TickRecord& tick : run.ticks) {
    const Measurement& m = tick.sensors;
    if (!(tick.applied.switches < patterns))
      throw ConfigError(fmt::format("{}: its tick at {:.3f} s applied the pattern {} (allowed: 0 to {}, of {} valves)",
                                    path, m.time_s, tick.applied.switches, patterns - 1, settings.valves));
    const double numbers[] = {m.value[position_channel], m.value[pressure_a_channel], m.value[pressure_b_channel],
                              tick.applied.continuous[0]};
    if (!std::ranges::all_of(numbers, [](double v) { return std::isfinite(v); }))
      continue;  // as if the tick were missing
    samples.add(m.time_s, numbers[0], numbers[1], numbers[2], numbers[3], tick.applied.switches);
  }
  Record about;
  about.valves = settings.valves;
  about.plane = settings.plane;
  LogRecords out = records_of(samples, path, about);
  if (!run.problem.empty()) out.told.insert(out.told.begin(), run.problem);
  return out;
}

void require_plausible(const LoggedSeries& series, const ColumnSource& source, const std::string& path) {
  for (std::size_t k = 0; k < series.size(); ++k)
    if (const auto why = implausible(source.name, series.value[k]))
      throw ConfigError(fmt::format("{}: {} at {:.6g} s: {}", path, shown(source.text), series.time_s[k], *why));
}

/// Numbers of JSON channels, brought to the times of the position's messages: pressures in straight lines between theirs,
/// motor and coils held, as they were commanded.
LogRecords records_from_channels(std::string_view bytes, const std::string& path, const LogSettings& settings) {
  const std::vector<ColumnSource> said = sources_of(settings);
  std::vector<ColumnSource> sources;
  sources.reserve(number_count);
  for (const WantedNumber& number : wanted_numbers()) {
    const ColumnSource* source = source_of(said, number.name);
    if (number.name == "time_s" && source)
      throw ConfigError(
          "--column time_s: of an MCAP log (allowed: none; times are those at which messages were logged)");
    if (number.name == "time_s") continue;
    if (!source)
      throw ConfigError(fmt::format("{}: no --column {} (allowed: {}=TOPIC.FIELD*FACTOR+OFFSET, of a JSON channel)",
                                    path, number.name, number.name));
    sources.push_back(*source);
  }
  const JsonSeries read = read_json_series(bytes, path, sources);
  for (std::size_t i = 0; i < sources.size(); ++i) require_plausible(read.series[i], sources[i], path);
  const auto of = [&](Number number) -> const LoggedSeries& { return read.series[number - 1]; };  // time has none
  const double patterns = patterns_of(settings.valves);
  LogSamples samples;
  for (std::size_t i = 0; i < of(position_number).size(); ++i) {
    const double t = of(position_number).time_s[i];
    if (t < of(motor_number).time_s.front() || t < of(coils_number).time_s.front()) continue;
    const double a = of(a_number).straight(t), b = of(b_number).straight(t), coils = of(coils_number).held(t);
    if (!(coils >= 0 && coils < patterns && coils == std::floor(coils)))
      throw ConfigError(
          fmt::format("{}: {}: coils {} at {:.6g} s (allowed: a whole number from 0 to {}, a bit a coil of {} "
                      "valves)",
                      path, shown(sources[coils_number - 1].text), coils, t, patterns - 1, settings.valves));
    if (!std::isfinite(a) || !std::isfinite(b)) continue;  // as if the message were missing
    samples.add(t, of(position_number).value[i], a, b, of(motor_number).held(t), static_cast<SwitchPattern>(coils));
  }
  Record about;
  about.valves = settings.valves;
  about.plane = settings.plane;
  LogRecords out = records_of(samples, path, about);
  if (!read.problem.empty()) out.told.insert(out.told.begin(), read.problem);
  return out;
}

}  // namespace

LogRecords records_from_csv(const std::string& text, const std::string& path, const LogSettings& settings) {
  return CsvLog(text, path, settings).read();
}

LogRecords read_log_records(const std::string& path, const LogSettings& settings) {
  LogRecords out;
  const auto bytes = read_whole_file(path, most_csv_bytes);
  if (!bytes) throw ConfigError(fmt::format("{}: cannot be read (allowed: a CSV, or an MCAP log of `run`)", path));
  const bool mcap = path.ends_with(".mcap") || bytes->starts_with(mcap_magic);
  if (!mcap)
    out = records_from_csv(*bytes, path, settings);
  else
    out = settings.columns.empty() ? records_from_run(path, settings) : records_from_channels(*bytes, path, settings);
  for (Record& record : out.records)
    if (record.name.empty()) record.name = std::filesystem::path(path).stem().string();
  return out;
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
