#pragma once

#include "controllers/systems/actuator/laws/law.hpp"
#include "controllers/systems/actuator/laws/settings.hpp"

#include <cmath>

namespace solenoid {

/// What a plant does that has no position control: valves open towards the target and close when the slide is near it.
///
///     d = y_target - y, towards the target from the last start on;    y_target = y_d(t + lead)
///     at rest        every valve closed, until |d| > start_m
///     moving         the chamber behind fills, the one ahead exhausts through its flow control
///     within cushion_m of the target: the one ahead is closed, and its trapped air is the cushion
///     until  d <= stop_m + anticipation_s * speed towards the target:  rest
///
/// Flow control is meter-out, as usual with cylinders: a throttle in the exhaust, of which coils have the mean, open
/// for exhaust_share of each period. A start begins a period.
///
/// The switching distance, its share by speed and the cushion are what installers set by hand, as makers'
/// guides to cushioning and exhaust throttles tell. The form is ours (docs/results/baselines.md).
class EndPosition {
 public:
  EndPosition(const EndPositionSettings& settings, const ModeSet& modes) : settings_(settings), patterns_(modes) {}

  SwitchPattern coils(const LawInput& in) noexcept {
    using enum ChamberAction;
    const double d = in.reference.at(in.time_s + settings_.lead_s).axis[0].value - in.state[position];
    if (way_ == 0 && std::abs(d) > settings_.start_m) way_ = d > 0.0 ? 1 : -1, begin_ = in.tick;
    const double left = way_ * d, speed = way_ * in.state[velocity];
    if (way_ != 0 && left <= settings_.stop_m + settings_.anticipation_s * std::max(speed, 0.0)) way_ = 0;
    if (way_ == 0) return patterns_(closed, closed);
    const ChamberAction ahead = left > settings_.cushion_m && throttle_is_open(in.tick) ? exhaust : closed;
    return way_ > 0 ? patterns_(fill, ahead) : patterns_(ahead, fill);
  }
  void restart() noexcept { way_ = 0; }

  /// 1 or -1 under way, 0 at rest.
  int way() const { return way_; }

 private:
  bool throttle_is_open(std::int64_t tick) const noexcept {
    const auto at = static_cast<double>((tick - begin_) % settings_.period_ticks);
    return at < settings_.exhaust_share * settings_.period_ticks;
  }

  EndPositionSettings settings_;
  ChamberPatterns patterns_;
  int way_ = 0;
  std::int64_t begin_ = 0;
};

}  // namespace solenoid
