#pragma once

#include <optional>
#include <string>
#include <vector>

namespace solenoid {

class TableReader;

/// Desired value of one axis and its derivatives at one moment [unit, unit/s, unit/s2].
struct MotionSample {
  double value = 0.0;
  double rate = 0.0;
  double acceleration = 0.0;

  /// The value itself, its first or its second derivative.
  constexpr double derivative(int order) const { return order == 0 ? value : order == 1 ? rate : acceleration; }
};

/// A trajectory is the desired motion y_d(t), t >= 0, of one axis, held at its last value after its end (model.md,
/// section 7). Its unit is the axis's.
class Trajectory {
 public:
  /// Holds `position_m` for ever.
  explicit Trajectory(double position_m) : start_(position_m), end_(position_m) {}

  /// Returns what is desired at a time; before 0, rest at the start.
  MotionSample at(double time_s) const;
  /// Returns when the last part ends.
  double duration_s() const { return duration_s_; }
  /// Returns the value at 0.
  double start() const { return start_; }
  /// Whether it is anything but one value for ever.
  bool moves() const { return !segments_.empty(); }
  /// Returns where the steady part of SSE and SSA starts, if the motion ends in a dwell: the dwell's second half, the
  /// first being left to the slide's settling.
  std::optional<double> steady_from_s() const { return steady_from_s_; }
  /// Returns the lowest and highest desired value, sampled at 1000 moments a second, or at 1000 if it is shorter. Of a
  /// motion that ends.
  std::pair<double, double> range() const;

  /// Appends a rest.
  Trajectory& dwell(double duration_s);
  /// Appends the cycloid (3.1): y + h (t/T - sin(2 pi t/T) / (2 pi)); velocity and acceleration vanish at both ends.
  Trajectory& cycloid_to(double position_m, double duration_s);
  /// Appends a jump to `position_m`, which is held.
  Trajectory& step_to(double position_m, double hold_s);
  /// Appends `periods` of a cosine that starts and ends at the current position and swings to `other_m`.
  Trajectory& cosine(double other_m, double frequency_hz, double periods);
  /// Appends amplitude cos(2 pi frequency_hz t + phase_rad), t from its own beginning, for `duration_s`, which may be
  /// infinite; nothing leads into it.
  Trajectory& harmonic(double amplitude, double frequency_hz, double phase_rad, double duration_s);
  /// Appends a motion through points (time, position), times increasing from 0, by cubic Hermite interpolation with
  /// central-difference slopes.
  Trajectory& through(std::vector<double> times_s, std::vector<double> positions_m);
  /// Marks the steady part as starting at `time_s`.
  Trajectory& steady_from(double time_s);

 private:
  struct Segment {
    enum class Kind { dwell, cycloid, cosine, harmonic, table } kind;
    double begin_s, duration_s, from_m, to_m;
    double frequency_hz = 0.0;
    std::vector<double> times_s, positions_m, slopes;
    double amplitude = 0.0, phase_rad = 0.0;
  };
  static MotionSample sample(const Segment& segment, double t);
  void append(Segment segment);

  double start_, end_;
  double duration_s_ = 0.0;
  std::optional<double> steady_from_s_;
  std::vector<Segment> segments_;
};

/// The longest motion and run that a file may ask for [s].
inline constexpr double longest_motion_s = 3600.0;

/// Reads `{ kind = "cycloidal" | "sine" | "step" | "multi_cycloid" | "csv", ... }`, none longer than longest_motion_s,
/// with _m standing for the axis's unit as keys have it (unit_in_keys):
///   cycloidal       from_m (default start), to_m, move_s, dwell_s
///   sine            from_m, to_m, frequency_hz, periods, lead_s (cycloids in and out)
///   step            from_m, height_m, at_s, hold_s, steady_s (the last part of hold_s)
///   multi_cycloid   from_m, to_m = [..], move_s, dwell_s
///   csv             path (relative to the file): lines `time_s,position_m` below one heading line
Trajectory read_trajectory(TableReader& table, double start, const std::string& unit = "m");

/// The two test motions of chapter 6, from `start_m` to 100 mm and, for the sine, back.
Trajectory thesis_cycloidal(double start_m);
/// The sine of the two; see thesis_cycloidal().
Trajectory thesis_sine(double start_m);

}  // namespace solenoid
