#pragma once

#include "core/reference/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace solenoid {

/// A trajectory that can begin anew at any time and from anywhere without a jump: a cycloid from the given position to
/// the trajectory's start, then the trajectory from its beginning. Until then it is the trajectory itself.
/// at, restart: no allocation or exception.
class RestartableReference {
 public:
  RestartableReference(Trajectory trajectory) : trajectory_(std::move(trajectory)) {}  // NOLINT: stands for one

  ReferenceSample at(double time_s) const {
    const double t = time_s - begin_s_;
    return t < approach_s_ ? approach(t) : trajectory_.at(t - approach_s_);
  }

  /// The approach takes at least half a second and moves at 50 mm/s on average at most.
  void restart(double time_s, double from_m) noexcept {
    begin_s_ = time_s;
    from_m_ = from_m;
    approach_s_ = std::max(0.5, std::abs(trajectory_.start_m() - from_m) / 0.05);
  }

  const Trajectory& trajectory() const { return trajectory_; }

 private:
  ReferenceSample approach(double t) const {
    const double height = trajectory_.start_m() - from_m_, turn = 2 * std::numbers::pi / approach_s_;
    const double share = std::clamp(t, 0.0, approach_s_) / approach_s_, phase = 2 * std::numbers::pi * share;
    return {from_m_ + height * (share - std::sin(phase) / (2 * std::numbers::pi)),
            height / approach_s_ * (1 - std::cos(phase)), height / approach_s_ * turn * std::sin(phase)};
  }

  Trajectory trajectory_;
  double begin_s_ = 0.0, approach_s_ = 0.0, from_m_ = 0.0;
};

}  // namespace solenoid
