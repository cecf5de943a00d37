#include "core/system/description.hpp"

#include <algorithm>
#include <cctype>
#include <stdexcept>

namespace solenoid {

std::string unit_in_keys(std::string unit) {
  if (unit == "%") return "percent";
  std::ranges::transform(unit, unit.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return unit;
}

std::string input_names(const SystemDescription& system) {
  std::string names;
  for (const Signal& input : system.continuous) names += (names.empty() ? "" : " ") + input.name;
  return names;
}

void require_complete(const SystemDescription& s) {
  const auto require = [&](bool right, const std::string& what) {
    if (!right) throw std::logic_error("description of '" + s.name + "': " + what);
  };
  const auto at_most = [&](std::size_t count, std::size_t most, const char* what) {
    require(count <= most, std::to_string(count) + " " + what + " (allowed: at most " + std::to_string(most) + ")");
  };
  require(!s.name.empty(), "no name");
  at_most(s.states.size(), max_states, "states");
  at_most(s.channels.size(), max_channels, "channels");
  at_most(s.continuous.size(), max_continuous, "continuous inputs");
  at_most(s.beliefs.size(), max_beliefs, "beliefs");
  at_most(s.axes.size(), max_axes, "axes");
  require(!s.axes.empty(), "no axis: nothing is given a desired motion");
  require(s.estimate_keys.size() == s.states.size(), "estimate_keys: one for each state");
  require(s.decided_keys.size() == s.continuous.size(), "decided_keys: one for each continuous input");
  require(s.reference_keys.size() == 2 * s.axes.size(), "reference_keys: two for each axis, all values first");
  for (const Axis& axis : s.axes) {
    require(axis.state < s.states.size(), "axis '" + axis.signal.name + "': no such state");
    require(axis.channel < s.channels.size(), "axis '" + axis.signal.name + "': no such channel");
    require(!axis.offset_key.empty(), "axis '" + axis.signal.name + "': no offset_key");
  }
  require(!s.outputs.empty(), "no output: nothing is tracked");
  for (const OutputSource& output : s.outputs) {
    require(output.axis < s.axes.size(), "output '" + output.name + "': no such axis");
    require(output.derivative >= 0 && output.derivative <= 2, "output '" + output.name + "': derivative 0, 1 or 2");
  }
  require(std::ranges::any_of(s.metrics, [&](const MetricColumn& m) { return m.key == s.judged.metric; }),
          "judged.metric '" + s.judged.metric + "' is no metric");
  require(s.timing.tick_s > 0.0 && s.timing.ticks_per_period >= 1, "timing: a positive tick, a tick a period or more");
}

}  // namespace solenoid
