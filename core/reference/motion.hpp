#pragma once

#include "core/reference/trajectory.hpp"
#include "core/system/signals.hpp"

#include <array>
#include <optional>
#include <vector>

namespace solenoid {

/// What is desired of every axis at one moment.
struct ReferenceSample {
  std::array<MotionSample, max_axes> axis{};
};

/// The desired motion of a system: a trajectory for each of its axes, in their order.
class Motion {
 public:
  /// Throws std::invalid_argument for none or more than max_axes.
  explicit Motion(std::vector<Trajectory> axes);
  Motion(Trajectory only) : axes_{std::move(only)} {}  // NOLINT: stands for a motion of one axis

  const std::vector<Trajectory>& axes() const { return axes_; }
  /// Returns what is desired at a time; before 0, rest at the start. No allocation.
  ReferenceSample at(double time_s) const {
    ReferenceSample sample;
    at(time_s, sample);
    return sample;
  }
  /// Writes the same into a sample; entries beyond the motion's axes stay as they are. For many moments in a row.
  void at(double time_s, ReferenceSample& sample) const;
  /// Returns when the last axis ends.
  double duration_s() const;
  /// Returns where every axis is steady, if each ends so (Trajectory::steady_from_s) or never moves.
  std::optional<double> steady_from_s() const;
  /// Returns each axis's value at 0.
  AxisValues start() const;

 private:
  std::vector<Trajectory> axes_;
};

}  // namespace solenoid
