#include "experiments/campaign/trace_layout.hpp"

#include <algorithm>
#include <iterator>

namespace solenoid {
namespace {

/// The panel of the axis's unit, appended if it is not there, with the axis in its label: "error x, y".
TraceLayout::Panel& panel_in(std::vector<TraceLayout::Panel>& panels, const std::string& what, const Axis& axis) {
  const std::string& label = axis.signal.label;
  const auto found = std::ranges::find(panels, axis.shown_unit, &TraceLayout::Panel::unit);
  if (found != panels.end()) {
    found->label += ", " + label;
    return *found;
  }
  return panels.emplace_back(
      TraceLayout::Panel{.label = what + label, .unit = axis.shown_unit, .scale = axis.shown_scale});
}

}  // namespace

double TraceLayout::usual_resolution(const std::string& unit) {
  if (unit == "m" || unit == "rad") return 1e-7;
  if (unit == "Pa") return 10.0;
  return 1e-3;
}

TraceLayout described_layout(const SystemDescription& system) {
  TraceLayout layout;
  std::vector<TraceLayout::Panel> values, errors;
  for (std::size_t a = 0; a < system.axes.size(); ++a) {
    const Axis& axis = system.axes[a];
    const Signal& state = system.states[axis.state];
    const std::string tail = system.axes.size() == 1 ? "" : "_" + state.name;
    const double resolution = TraceLayout::usual_resolution(axis.signal.unit);
    layout.kept.push_back({"reference" + tail, axis.signal.unit, resolution, TraceLayout::Source::reference, a, 0});
    layout.kept.push_back({state.name, state.unit, resolution, TraceLayout::Source::state, axis.state, axis.channel});
    layout.derived.push_back(
        {"error" + tail, axis.signal.unit, resolution, 0.0, {{"reference" + tail, 1.0}, {state.name, -1.0}}});
    TraceLayout::Panel& value = panel_in(values, "", axis);
    value.curves.push_back({state.name, axis.signal.label});
    value.curves.push_back({"reference" + tail, axis.signal.label + ", desired", true});
    TraceLayout::Panel& error = panel_in(errors, "error ", axis);
    error.curves.push_back({"error" + tail, "error " + axis.signal.label});
    error.zero = true;
  }
  if (errors.size() == 1) errors.front().label = "error";
  layout.kept.push_back({"mode", "", 1.0, TraceLayout::Source::mode});
  layout.panels = std::move(values);
  std::ranges::move(errors, std::back_inserter(layout.panels));
  layout.panels.push_back({.label = system.switch_noun + " mode", .curves = {{"mode", "mode"}}, .modes = true});
  for (std::size_t i = 0; i < system.continuous.size(); ++i) {
    const Signal& input = system.continuous[i];
    layout.kept.push_back(
        {input.name, input.unit, TraceLayout::usual_resolution(input.unit), TraceLayout::Source::continuous, i, 0});
    layout.panels.push_back(
        {.label = input.label, .unit = input.unit, .curves = {{input.name, input.label}}, .zero = true});
  }
  return layout;
}

}  // namespace solenoid
