#pragma once

#include "core/reference/motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace solenoid {

/// A motion that can begin anew at any time and from anywhere without a jump: every axis goes by a cycloid from a given
/// value to the motion's start, all of them together, then the motion from its beginning. Until then it is the motion
/// itself.
/// at, restart: no allocation or exception.
class RestartableReference {
 public:
  /// The fastest that each axis may approach its start on average [unit/s].
  explicit RestartableReference(Motion motion, const AxisValues& speeds = filled(0.05))
      : motion_(std::move(motion)), speeds_(speeds) {}
  RestartableReference(Trajectory only) : RestartableReference(Motion(std::move(only))) {}  // NOLINT: stands for one

  ReferenceSample at(double time_s) const {
    ReferenceSample sample;
    at(time_s, sample);
    return sample;
  }
  /// Writes the same into a sample, as Motion::at() does.
  void at(double time_s, ReferenceSample& sample) const {
    const double t = time_s - begin_s_;
    if (t < approach_s_)
      approach(t, sample);
    else
      motion_.at(t - approach_s_, sample);
  }

  /// The approach takes at least half a second.
  void restart(double time_s, const AxisValues& from) noexcept {
    begin_s_ = time_s;
    from_ = from;
    approach_s_ = 0.5;
    for (std::size_t a = 0; a < motion_.axes().size(); ++a)
      approach_s_ = std::max(approach_s_, std::abs(motion_.axes()[a].start() - from[a]) / speeds_[a]);
  }

  const Motion& motion() const { return motion_; }

 private:
  static AxisValues filled(double value) {
    AxisValues all;
    all.fill(value);
    return all;
  }

  void approach(double t, ReferenceSample& sample) const {
    const double turn = 2 * std::numbers::pi / approach_s_;
    const double share = std::clamp(t, 0.0, approach_s_) / approach_s_, phase = 2 * std::numbers::pi * share;
    for (std::size_t a = 0; a < motion_.axes().size(); ++a) {
      const double height = motion_.axes()[a].start() - from_[a];
      sample.axis[a] = {from_[a] + height * (share - std::sin(phase) / (2 * std::numbers::pi)),
                        height / approach_s_ * (1 - std::cos(phase)), height / approach_s_ * turn * std::sin(phase)};
    }
  }

  Motion motion_;
  AxisValues speeds_, from_{};
  double begin_s_ = 0.0, approach_s_ = 0.0;
};

}  // namespace solenoid
