#include "controllers/described_system.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

[[noreturn]] void refuse(const ModelDescription& said, const std::string& what) {
  throw std::logic_error(fmt::format("description of '{}': {}", said.name, what));
}

std::size_t find_state(const ModelDescription& said, const std::string& name) {
  const auto found = std::ranges::find(said.states, name, &ModelDescription::State::name);
  if (found == said.states.end()) refuse(said, fmt::format("no state '{}'", name));
  return static_cast<std::size_t>(found - said.states.begin());
}

/// "true_level_m"; without a unit "true_level".
std::string keyed(const std::string& before, const std::string& name, const std::string& unit) {
  std::string key = before + name;
  for (const char c : unit_in_keys(unit).empty() ? "" : "_" + unit_in_keys(unit))
    key += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return key;
}

Axis axis_of(const ModelDescription& said, const ModelDescription::Output& output, std::size_t channel) {
  const std::size_t index = find_state(said, output.state);
  const ModelDescription::State& state = said.states[index];
  Axis axis;
  axis.signal = {state.name, state.unit, keyed("reference_", state.name, state.unit), state.name, "desired"};
  axis.shown_unit = state.shown_unit.empty() ? state.unit : state.shown_unit;
  axis.shown_scale = state.shown_scale;
  axis.rate_label = "rate";
  axis.offset_key = "offset_" + state.name;
  axis.state = index;
  axis.channel = channel;
  return axis;
}

/// Which channel shows a state.
std::size_t channel_of(const ModelDescription& said, const std::string& state) {
  const auto found = std::ranges::find(said.channels, state, &ModelDescription::Channel::state);
  if (found == said.channels.end())
    refuse(said, fmt::format("output '{}' is not measured: no channel shows it", state));
  return static_cast<std::size_t>(found - said.channels.begin());
}

void add_outputs(const ModelDescription& said, SystemDescription& s) {
  const auto inverse_square = [](const std::string& unit) { return unit.empty() ? unit : "1/" + unit + "2"; };
  std::vector<std::string> axes;
  for (const ModelDescription::Output& output : said.outputs) {
    const std::string& unit = said.states[find_state(said, output.state)].unit;
    const std::string& axis = output.rate_of.empty() ? output.state : output.rate_of;
    if (output.rate_of.empty()) {
      s.axes.push_back(axis_of(said, output, channel_of(said, output.state)));
      axes.push_back(axis);
    }
    const auto at = std::ranges::find(axes, axis);
    if (at == axes.end())
      refuse(said, fmt::format("output '{}' is the rate of '{}', which is no output", output.state, axis));
    s.outputs.push_back({static_cast<std::size_t>(at - axes.begin()), output.rate_of.empty() ? 0 : 1, output.state,
                         inverse_square(unit)});
  }
  for (const char* of : {"reference_", "reference_rate_"})
    for (const Axis& axis : s.axes) s.reference_keys.push_back(keyed(of, axis.signal.name, axis.signal.unit));
}

void add_metrics(const ModelDescription& said, SystemDescription& s) {
  s.metrics.push_back({.key = "objective", .heading = "objective"});
  for (const Axis& axis : s.axes) {
    s.metrics.push_back({.key = keyed("rmse_", axis.signal.name, axis.signal.unit),
                         .heading = fmt::format("RMSE {} {}", axis.signal.name, axis.signal.unit)});
    s.metrics.push_back({.key = keyed("largest_", axis.signal.name, axis.signal.unit)});
  }
  if (const Signal& c = said.consumption; !c.name.empty())
    s.metrics.push_back({.key = keyed("", c.name, c.unit), .heading = c.name + " " + c.unit, .effort = true});
  s.metrics.push_back({.key = "switches", .whole = true, .heading = "switches"});
  s.metrics.push_back({.key = "switches_per_s", .heading = "switches/s", .effort = true, .detail = false});
  s.judged = {"objective", "integral of the weighted squared errors"};
}

SystemDescription described(const ModelDescription& said) {
  SystemDescription s;
  s.name = said.name;
  s.summary = said.summary;
  for (const ModelDescription::State& state : said.states) {
    s.states.push_back({state.name, state.unit, keyed("true_", state.name, state.unit), state.name, state.meaning});
    s.estimate_keys.push_back(keyed("estimate_", state.name, state.unit));
  }
  for (const ModelDescription::Channel& channel : said.channels) {
    const ModelDescription::State& state = said.states[find_state(said, channel.state)];
    s.channels.push_back({state.name, state.unit, keyed("", state.name, state.unit), state.name, "measured"});
  }
  for (const ModelDescription::Input& input : said.inputs) {
    s.continuous.push_back({input.name, input.unit, keyed("", input.name, input.unit), input.name});
    s.decided_keys.push_back(keyed("decided_", input.name, input.unit));
  }
  s.consumption = said.consumption;
  s.timing = said.timing;
  add_outputs(said, s);
  add_metrics(said, s);
  return s;
}

ModelDescription with_channels(ModelDescription said) {
  if (said.channels.empty())
    for (const ModelDescription::State& state : said.states) said.channels.push_back({state.name, 1e-6});
  return said;
}

}  // namespace

DescribedParts::DescribedParts(ModelDescription said)
    : said_(with_channels(std::move(said))), system_(described(said_)) {
  if (said_.mode_sets.empty()) refuse(said_, "no mode set");
}

std::size_t DescribedParts::state_of(const std::string& name) const { return find_state(said_, name); }

std::vector<double> DescribedParts::read_parameters(TableReader& table, std::vector<double> values) const {
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = table.number_or(said_.parameters[i].name, values[i], said_.parameters[i].range);
  table.finish();
  return values;
}

DescribedVariant DescribedParts::usual() const {
  DescribedVariant own;
  for (const ModelDescription::Parameter& parameter : said_.parameters) own.parameters.push_back(parameter.usual);
  for (const ModelDescription::Channel& channel : said_.channels) own.channel_sigma.push_back(channel.sigma);
  return own;
}

VariantConfig DescribedParts::defaults() const {
  VariantConfig v;
  v.modes = said_.mode_sets.front().name;
  v.estimator = "kalman";
  v.solver = "branch_and_bound";
  v.horizon = {said_.steps, said_.blocks};
  v.cost.tracking = v.cost.terminal = {};
  for (std::size_t i = 0; i < said_.outputs.size(); ++i) {
    v.cost.tracking[i] = said_.outputs[i].weight;
    v.cost.terminal[i] = said_.outputs[i].terminal;
  }
  for (std::size_t i = 0; i < said_.inputs.size(); ++i) v.cost.continuous[i] = said_.inputs[i].weight;
  v.cost.switching = said_.switching;
  v.own.as<DescribedVariant>() = usual();
  return v;
}

ModeSet DescribedParts::modes(const std::string& name) const {
  for (const ModelDescription::Modes& m : said_.mode_sets)
    if (m.name == name) return {m.name, m.switches, m.modes, m.offset, m.gain, m.one_at_a_time, m.safe};
  throw std::invalid_argument(fmt::format("system '{}' has no mode set '{}'", said_.name, name));
}

std::vector<std::string> DescribedParts::mode_sets() const {
  std::vector<std::string> names;
  for (const ModelDescription::Modes& m : said_.mode_sets) names.push_back(m.name);
  return names;
}

std::vector<VariantKey> DescribedParts::keys() const {
  std::vector<VariantKey> keys;
  const KeyGroup all{keys, "estimation"};
  for (std::size_t c = 0; c < said_.channels.size(); ++c) {
    const ModelDescription::State& state = said_.states[state_of(said_.channels[c].state)];
    all.add(fmt::format("estimation.{}_sigma", state.name), VariantKey::At<double>([c](VariantConfig& v) -> double& {
              return v.own.as<DescribedVariant>().channel_sigma[c];
            }),
            Range::positive(), state.unit, fmt::format("white noise of {}", state.name));
  }
  return keys;
}

LadderSettings DescribedParts::ladder() const {
  LadderSettings settings;
  for (std::size_t c = 0; c < said_.channels.size(); ++c) {
    const ModelDescription::State& state = said_.states[state_of(said_.channels[c].state)];
    const double low = std::isfinite(state.low) ? state.low : -1e9, high = std::isfinite(state.high) ? state.high : 1e9;
    const double beyond = 10 * said_.channels[c].sigma;
    settings.plausibility.channels.push_back({.low = low - beyond,
                                              .high = high + beyond,
                                              .rail_low = low - (high - low),
                                              .rail_high = high + (high - low),
                                              .slew_per_tick = high - low,
                                              .sigma = said_.channels[c].sigma});
    settings.limits.push_back({});
    settings.needed_to_stop.push_back(c);
  }
  return settings;
}

}  // namespace solenoid
