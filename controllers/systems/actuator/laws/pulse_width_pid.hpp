#pragma once

#include "controllers/systems/actuator/laws/law.hpp"
#include "controllers/systems/actuator/laws/settings.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {

/// On-times of one valve that fills while its coil is on, made of whole ticks: at most a pulse a period.
///
/// A duty d of a period of N ticks asks for d N ticks in effect. Of all commands the one is taken that comes nearest,
/// counted through the valve's delays; what is left over (fractions of a tick, pauses and pulses shorter than the dead
/// time) goes to the next period.
class ValvePulses {
 public:
  ValvePulses(int period_ticks, int rise_ticks, int fall_ticks)
      : period_(period_ticks), rise_(rise_ticks), fall_(fall_ticks) {}

  /// Plans a period that begins with the coil as it is commanded now; gives the ticks for which it is to be on, from
  /// the period's beginning.
  int plan(double duty, bool on) noexcept {
    const double wanted = std::clamp(duty, 0.0, 1.0) * period_ + left_over_;
    int best = 0;
    for (int ticks = 1; ticks <= period_; ++ticks) {
      if (in_effect(ticks, on) == 0) continue;  // swallowed: edges for nothing
      const double miss = std::abs(wanted - worth(ticks, on)), least = std::abs(wanted - worth(best, on));
      if (miss < least || (miss == least && ticks == period_)) best = ticks;
    }
    left_over_ = std::clamp(wanted - in_effect(best, on), -0.5 * period_, 0.5 * period_);
    return best;
  }

 private:
  /// Ticks that a command of so many brings, those after the period's end included unless it goes on into the next.
  int in_effect(int ticks, bool on) const noexcept {
    if (ticks == period_) return on ? period_ : std::max(0, period_ - rise_);
    return on ? ticks + fall_ : ticks == 0 ? 0 : std::max(0, ticks - rise_ + fall_);
  }

  /// What a command is chosen for: staying on is a full period, though its first one loses the rising delay. Else a
  /// pulse that only just ends inside the period would be as good, and high duties out of reach.
  int worth(int ticks, bool on) const noexcept { return ticks == period_ ? period_ : in_effect(ticks, on); }

  int period_, rise_, fall_;
  double left_over_ = 0.0;
};

/// Position control by pulse width: PID with bounded integral, friction compensation and position feedforward.
///
///     e   = y_d - y,    once a pulse period T
///     I  <- clamp(I + K_i e T, -I_max, I_max)
///     u   = clamp(K_p e + K_d (v_d - v) + I + K_ff (y_d(t + lead) - y_d(t)) + u_f, -1, 1)
///     u_f = F sign(v_d) where a motion is desired, F sign(e) at rest where |e| > band, else 0
///     duty of valve A = bias + u/2,  of valve B = bias - u/2,  cut to [0, 1]; on fills, off exhausts
///
/// With bias 1/2 both valves pulse at u = 0 and neither is near its dead time: the symmetrical characteristic that the
/// paper's pulsing is after. The valves are its own, two 3/2 ones.
///
/// R. B. van Varseveld, G. M. Bone, "Accurate position control of a pneumatic actuator using on/off solenoid valves",
/// IEEE/ASME Transactions on Mechatronics 2(3), 195-204, 1997. The terms are the paper's; their exact forms and the
/// split of u over the valves are our reading (docs/results/baselines.md).
class PulseWidthPid {
 public:
  PulseWidthPid(const PulseWidthSettings& settings, const ModeSet& three_way, double tick_s)
      : settings_(settings),
        tick_s_(tick_s),
        patterns_(three_way),
        a_(pulses(settings, SwitchTiming(three_way, tick_s), 0)),
        b_(pulses(settings, SwitchTiming(three_way, tick_s), 1)) {}

  SwitchPattern coils(const LawInput& in) noexcept {
    if (begin_ < 0 || in.tick - begin_ >= settings_.period_ticks) plan(in);
    const std::int64_t at = in.tick - begin_;
    last_a_ = at < on_a_, last_b_ = at < on_b_;
    const auto action = [](bool on) { return on ? ChamberAction::fill : ChamberAction::exhaust; };
    return patterns_(action(last_a_), action(last_b_));
  }
  void restart() noexcept { integral_ = 0.0, begin_ = -1; }

  /// The law without its pulses: u of this moment, the integral moved on by a period.
  double duty(const LawInput& in) noexcept {
    const PulseWidthSettings& s = settings_;
    const double error = in.desired.value - in.state[position];
    integral_ =
        std::clamp(integral_ + s.integral * error * s.period_ticks * tick_s_, -s.integral_limit, s.integral_limit);
    const double coming = in.reference.at(in.time_s + s.lead_s).axis[0].value - in.desired.value;
    const double u = s.proportional * error + s.derivative * (in.desired.rate - in.state[velocity]) + integral_ +
                     s.feedforward * coming + friction_share(in.desired.rate, error);
    return std::clamp(u, -1.0, 1.0);
  }
  double integral() const { return integral_; }

 private:
  static ValvePulses pulses(const PulseWidthSettings& s, const SwitchTiming& timing, std::size_t coil) {
    return {s.period_ticks, timing.rise[coil], timing.fall[coil]};
  }
  double friction_share(double desired_velocity, double error) const noexcept {
    constexpr double at_rest_m_s = 1e-4;
    if (std::abs(desired_velocity) > at_rest_m_s) return std::copysign(settings_.friction, desired_velocity);
    return std::abs(error) > settings_.friction_band_m ? std::copysign(settings_.friction, error) : 0.0;
  }
  void plan(const LawInput& in) noexcept {
    begin_ = in.tick;
    const double u = duty(in);
    on_a_ = a_.plan(settings_.bias + 0.5 * u, last_a_);
    on_b_ = b_.plan(settings_.bias - 0.5 * u, last_b_);
  }

  PulseWidthSettings settings_;
  double tick_s_;
  ChamberPatterns patterns_;
  ValvePulses a_, b_;
  double integral_ = 0.0;
  std::int64_t begin_ = -1;
  int on_a_ = 0, on_b_ = 0;
  bool last_a_ = false, last_b_ = false;
};

}  // namespace solenoid
