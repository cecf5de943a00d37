#include "core/reference/motion.hpp"

#include <stdexcept>

namespace solenoid {

Motion::Motion(std::vector<Trajectory> axes) : axes_(std::move(axes)) {
  if (axes_.empty() || axes_.size() > max_axes) throw std::invalid_argument("motion: needs one to four axes");
}

void Motion::at(double time_s, ReferenceSample& sample) const {
  for (std::size_t a = 0; a < axes_.size(); ++a) sample.axis[a] = axes_[a].at(time_s);
}

double Motion::duration_s() const {
  double longest_s = 0.0;
  for (const Trajectory& axis : axes_) longest_s = std::max(longest_s, axis.duration_s());
  return longest_s;
}

std::optional<double> Motion::steady_from_s() const {
  std::optional<double> from_s;
  for (const Trajectory& axis : axes_) {
    if (!axis.moves()) continue;
    if (!axis.steady_from_s()) return {};
    from_s = std::max(from_s.value_or(0.0), *axis.steady_from_s());
  }
  return from_s;
}

AxisValues Motion::start() const {
  AxisValues start{};
  for (std::size_t a = 0; a < axes_.size(); ++a) start[a] = axes_[a].start();
  return start;
}

}  // namespace solenoid
