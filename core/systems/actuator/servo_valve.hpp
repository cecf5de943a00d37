#pragma once

#include <array>
#include <numbers>
#include <string>

namespace solenoid {

class TableReader;

/// A servo valve a chamber, in place of valves that switch: command c in [-1, 1], supply to chamber by c > 0, chamber to
/// atmosphere by c < 0; 1 opens as far as the single on/off valve, so that the largest flow is the same.
///                                                                                              [model.md, section 5]
///
///     c_h <- max(b - h/2, min(b + h/2, c_h)),   b = (1 + h/2) c                          play of width h: hysteresis
///     x'' + 2 zeta w x' + w^2 x = w^2 c_h,   w = 2 pi f                                  spool
///     s_fill    = min(1, max((x - d)/(1 - d),  lambda clamp(1 + x/l, 0, 1)))             overlap and leakage
///     s_exhaust = the same of -x
///
/// Each path leaks by lambda at null and wherever the spool opens it, and no longer once the spool has moved by l the
/// other way; an open path's leakage is in its opening.
///
/// The defaults are assumed: typical of 5/3-way proportional directional control valves of this size, whose
/// manufacturers state a hysteresis of some 0.4 % of the stroke and critical frequencies of 65 to 125 Hz; 50 Hz is the
/// task's. With zeta = 1/sqrt(2) the gain is -3 dB and the phase -90 degrees at f: the critical frequency by either
/// definition. Overlap and leakage are in no data sheet; 5 % and 1 % are what such valves are reported to have.
struct ServoValve {
  double frequency_hz = 50.0;                ///< f; 0: the spool is where c_h is
  double damping = std::numbers::sqrt2 / 2;  ///< zeta
  double dead_band = 0.05;                   ///< d, of the command to either side of null
  double hysteresis = 0.008;                 ///< h: 0.4 % of a stroke of 2
  double leakage = 0.01;                     ///< lambda
  double leakage_width = 0.1;                ///< l

  /// What a path is open by at spool position x: the fill path, the exhaust path at -x.
  double opening(double x) const noexcept;
  bool operator==(const ServoValve&) const = default;
};

/// Overrides fields from a table whose keys are the field names, and finishes it. Throws ConfigError.
void read_servo_valve(TableReader& table, ServoValve& valve);
/// The first thing that is wrong with it, "key 'dead_band': ... (allowed: ...)"; empty if nothing is.
std::string servo_valve_problem(const ServoValve& valve);

/// A spool's deviation (x - c_h, x') after a time t at constant c_h: this matrix times that before, exp(A t) in closed
/// form for damping below 1.
struct SpoolStep {
  double xx = 0.0, xv = 0.0, vx = 0.0, vv = 0.0;
  /// Zeros, a spool without inertia, where the frequency is 0.
  SpoolStep() = default;
  SpoolStep(const ServoValve& valve, double t) noexcept;
};

/// A spool at a moment, and what it is commanded to.
struct Spool {
  double x = 0.0;       ///< position
  double v = 0.0;       ///< [1/s]
  double target = 0.0;  ///< c_h

  /// Takes a command through the play; it is cut at [-1, 1], and what is no number changes nothing.
  void command(const ServoValve& valve, double c) noexcept;
  /// The spool a time later, at the same command.
  Spool after(const SpoolStep& step) const noexcept {
    const double e = x - target;
    return {target + step.xx * e + step.xv * v, step.vx * e + step.vv * v, target};
  }
};

/// The signed opening that a spool stands for, (|x| - d)/(1 - d) with its sign or 0, and its rate: the states of
/// ServoActuator.
std::array<double, 2> signed_opening(const ServoValve& valve, const Spool& spool) noexcept;

/// Both chambers' valves in ticks of constant length: what a plant does, and what a controller believes.
class ServoPair {
 public:
  ServoPair(const ServoValve& valve, double tick_s) : valve_(valve), step_(valve, tick_s) {}

  /// The openings (fill A, exhaust A, fill B, exhaust B) of the coming tick under these commands, means of those at its
  /// begin and end. May be asked again with other commands before advance().
  std::array<double, 4> openings(double command_a, double command_b) noexcept;
  /// The tick is over.
  void advance() noexcept { now_ = next_; }
  /// Signed opening and rate of A, then of B.
  std::array<double, 4> state() const noexcept;

 private:
  ServoValve valve_;
  SpoolStep step_;
  std::array<Spool, 2> now_{}, next_{};
};

}  // namespace solenoid
