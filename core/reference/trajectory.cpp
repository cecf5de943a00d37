#include "core/reference/trajectory.hpp"

#include "core/config/reader.hpp"
#include "core/system/description.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;

MotionSample hermite(double t, double t0, double t1, double p0, double p1, double m0, double m1) {
  const double h = t1 - t0, s = (t - t0) / h;
  const double d = (p1 - p0) / h;
  // p = p0 + s h m0 + s^2 h (3 d - 2 m0 - m1) + s^3 h (m0 + m1 - 2 d)
  const double c2 = 3 * d - 2 * m0 - m1, c3 = m0 + m1 - 2 * d;
  return {p0 + h * s * (m0 + s * (c2 + s * c3)), m0 + s * (2 * c2 + 3 * s * c3), (2 * c2 + 6 * s * c3) / h};
}

}  // namespace

MotionSample Trajectory::at(double time_s) const {
  if (time_s < 0 || segments_.empty()) return {start_, 0, 0};
  const auto end_s = [](const Segment& segment) { return segment.begin_s + segment.duration_s; };
  const auto segment = std::ranges::upper_bound(segments_, time_s, {}, end_s);
  if (segment == segments_.end()) return {end_, 0, 0};
  return sample(*segment, time_s - segment->begin_s);
}

MotionSample Trajectory::sample(const Segment& g, double t) {
  const double rise = g.to_m - g.from_m;
  switch (g.kind) {
    case Segment::Kind::dwell:
      return {g.to_m, 0, 0};
    case Segment::Kind::cycloid: {
      const double phase = two_pi * t / g.duration_s;
      return {g.from_m + rise * (t / g.duration_s - std::sin(phase) / two_pi),
              rise / g.duration_s * (1 - std::cos(phase)),
              rise * two_pi / (g.duration_s * g.duration_s) * std::sin(phase)};
    }
    case Segment::Kind::cosine: {
      const double w = two_pi * g.frequency_hz, half = rise / 2;
      return {g.from_m + half * (1 - std::cos(w * t)), half * w * std::sin(w * t), half * w * w * std::cos(w * t)};
    }
    case Segment::Kind::harmonic: {
      const double w = two_pi * g.frequency_hz, angle = w * t + g.phase_rad, value = g.amplitude * std::cos(angle);
      return {value, -w * g.amplitude * std::sin(angle), -w * w * value};
    }
    case Segment::Kind::table: {
      const auto after = std::upper_bound(g.times_s.begin(), g.times_s.end(), t);
      const auto i = static_cast<std::size_t>(
          std::clamp<std::ptrdiff_t>(after - g.times_s.begin(), 1, static_cast<std::ptrdiff_t>(g.times_s.size()) - 1));
      return hermite(t, g.times_s[i - 1], g.times_s[i], g.positions_m[i - 1], g.positions_m[i], g.slopes[i - 1],
                     g.slopes[i]);
    }
  }
  return {};
}

std::pair<double, double> Trajectory::range() const {
  double low = std::min(start_, end_), high = std::max(start_, end_);
  const double step_s = std::min(1e-3, duration_s_ / 1000);
  for (double t = 0; t < duration_s_; t += step_s) {
    const double y = at(t).value;
    low = std::min(low, y);
    high = std::max(high, y);
  }
  return {low, high};
}

void Trajectory::append(Segment segment) {
  segment.begin_s = duration_s_;
  duration_s_ += segment.duration_s;
  segments_.push_back(std::move(segment));
}

Trajectory& Trajectory::dwell(double duration_s) {
  steady_from_s_ = duration_s_ + duration_s / 2;
  append({Segment::Kind::dwell, 0, duration_s, end_, end_, 0, {}, {}, {}});
  return *this;
}

Trajectory& Trajectory::cycloid_to(double position_m, double duration_s) {
  steady_from_s_.reset();
  append({Segment::Kind::cycloid, 0, duration_s, end_, position_m, 0, {}, {}, {}});
  end_ = position_m;
  return *this;
}

Trajectory& Trajectory::step_to(double position_m, double hold_s) {
  end_ = position_m;
  return dwell(hold_s);
}

Trajectory& Trajectory::cosine(double other_m, double frequency_hz, double periods) {
  steady_from_s_.reset();
  append({Segment::Kind::cosine, 0, periods / frequency_hz, end_, other_m, frequency_hz, {}, {}, {}});
  return *this;
}

Trajectory& Trajectory::harmonic(double amplitude, double frequency_hz, double phase_rad, double duration_s) {
  steady_from_s_.reset();
  Segment segment{Segment::Kind::harmonic, 0, duration_s, 0, 0, frequency_hz, {}, {}, {}, amplitude, phase_rad};
  if (segments_.empty()) start_ = sample(segment, 0).value;
  end_ = std::isfinite(duration_s) ? sample(segment, duration_s).value : 0.0;
  append(std::move(segment));
  return *this;
}

Trajectory& Trajectory::through(std::vector<double> times_s, std::vector<double> positions_m) {
  steady_from_s_.reset();
  const std::size_t n = times_s.size();
  std::vector<double> slopes(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i)
    slopes[i] = (positions_m[i + 1] - positions_m[i - 1]) / (times_s[i + 1] - times_s[i - 1]);
  end_ = positions_m.back();
  const double length = times_s.back();
  append({Segment::Kind::table, 0, length, positions_m.front(), end_, 0, std::move(times_s), std::move(positions_m),
          std::move(slopes)});
  return *this;
}

Trajectory& Trajectory::steady_from(double time_s) {
  steady_from_s_ = time_s;
  return *this;
}

Trajectory thesis_cycloidal(double start_m) { return Trajectory(start_m).dwell(2).cycloid_to(0.1, 4).dwell(2); }

Trajectory thesis_sine(double start_m) {
  return Trajectory(start_m).cycloid_to(0.1, 1).cosine(start_m, 1.0, 6).cycloid_to(start_m, 1);
}

namespace {

/// Parses `time_s,position_m` lines; errors name the file and line.
Trajectory read_csv(const LinkedFile& file) {
  const auto refuse = [&](int line, const std::string& problem) {
    throw ConfigError(
        fmt::format("{}:{}: {} (allowed: a heading line, then lines `time_s,position_m` with times "
                    "increasing from 0)",
                    file.path, line, problem));
  };
  if (!file.text)
    throw ConfigError(fmt::format("{}: trajectory cannot be read (allowed: a readable CSV file)", file.path));
  std::istringstream in(*file.text);
  std::vector<double> times, positions;
  std::string text;
  std::getline(in, text);
  for (int line = 2; std::getline(in, text); ++line) {
    if (text.empty() || text == "\r") continue;
    double time = 0, position = 0;
    char comma = 0, more = 0;
    std::istringstream fields(text);
    if (!(fields >> time >> comma >> position) || comma != ',' || (fields >> more))
      refuse(line, fmt::format("'{}' is not two numbers", text.substr(0, 40)));
    if (!std::isfinite(time) || !std::isfinite(position)) refuse(line, "not finite");
    if (times.empty() ? time != 0.0 : time <= times.back()) refuse(line, fmt::format("time {} is out of order", time));
    if (time > longest_motion_s) refuse(line, fmt::format("time {} is beyond {:g} s", time, longest_motion_s));
    times.push_back(time);
    positions.push_back(position);
  }
  if (times.size() < 2) refuse(1, "fewer than two points");
  const double start = positions.front();
  return Trajectory(start).through(std::move(times), std::move(positions));
}

/// Refuses a motion whose parts are allowed and whose sum is not, before anybody samples it.
void require_an_end(const TableReader& table, const std::string& key, const Trajectory& trajectory) {
  if (!(trajectory.duration_s() <= longest_motion_s))
    table.fail(key, fmt::format("with it the motion takes {:g} s (allowed: at most {:g} s)", trajectory.duration_s(),
                                longest_motion_s));
}

}  // namespace

Trajectory read_trajectory(TableReader& table, double start, const std::string& unit) {
  const std::string key = unit_in_keys(unit), from = "from_" + key, to = "to_" + key, height = "height_" + key;
  const std::string kind = table.text("kind", {"cycloidal", "sine", "step", "multi_cycloid", "csv"});
  const Range pause = Range::between(0.0, longest_motion_s), move = {0.0, longest_motion_s, true};
  Trajectory trajectory(kind == "csv" ? 0.0 : table.number_or(from, start));
  if (kind == "cycloidal") {
    const double dwell = table.number_or("dwell_s", 2.0, pause);
    trajectory.dwell(dwell).cycloid_to(table.number_or(to, 0.1), table.number_or("move_s", 4.0, move)).dwell(dwell);
    require_an_end(table, "dwell_s", trajectory);
  } else if (kind == "sine") {
    const double low = trajectory.start(), lead = table.number_or("lead_s", 1.0, move);
    trajectory.cycloid_to(table.number_or(to, 0.1), lead)
        .cosine(low, table.number_or("frequency_hz", 1.0, {0.0, 100.0, true}),
                table.number_or("periods", 6.0, Range::positive()))
        .cycloid_to(low, lead);
    require_an_end(table, table.has("periods") ? "periods" : "frequency_hz", trajectory);
  } else if (kind == "step") {
    const double hold = table.number_or("hold_s", 4.5, move);
    trajectory.dwell(table.number_or("at_s", 0.5, pause))
        .step_to(trajectory.start() + table.number_or(height, 0.06), hold);
    require_an_end(table, "hold_s", trajectory);
    trajectory.steady_from(trajectory.duration_s() - table.number_or("steady_s", 1.0, Range::between(0.0, hold)));
  } else if (kind == "multi_cycloid") {
    const double move_s = table.number_or("move_s", 1.0, move), dwell_s = table.number_or("dwell_s", 1.0, pause);
    const std::vector<double> stations = table.numbers(to);
    if (stations.empty()) table.fail(to, "empty (allowed: at least one position)");
    for (const double station : stations) trajectory.cycloid_to(station, move_s).dwell(dwell_s);
    require_an_end(table, to, trajectory);
  } else {
    trajectory = read_csv(table.file("path"));
  }
  table.finish();
  return trajectory;
}

}  // namespace solenoid
