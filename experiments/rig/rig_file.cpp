#include "experiments/rig/rig_file.hpp"

#include "core/config/document.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/files.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr int most_channels = 31;  // of one masked write

void read_inputs(TableReader& t, const SystemDescription& system, ComediSettings& c) {
  c.input_subdevice = t.integer_or("subdevice", c.input_subdevice, 0, 63);
  for (std::size_t i = 0; i < c.input_channels.size(); ++i)
    c.input_channels[i] = t.integer_or(system.channels[i].name, c.input_channels[i], 0, 255);
  c.input_range = t.integer_or("range", c.input_range, 0, 31);
  c.reference = t.text_or("reference", c.reference, {"ground", "common", "diff"});
  t.finish();
}

void read_output(TableReader& t, ComediSettings::Output& output) {
  output.subdevice = t.integer_or("subdevice", output.subdevice, 0, 63);
  output.channel = t.integer_or("channel", output.channel, 0, 255);
  output.range = t.integer_or("range", output.range, 0, 31);
  t.finish();
}

void read_switches(TableReader& t, const std::string& key, std::size_t switches, ComediSettings& c) {
  c.digital_subdevice = t.integer_or("subdevice", c.digital_subdevice, 0, 63);
  if (t.has(key)) c.switch_channels = t.integers(key, 0, most_channels);
  if (c.switch_channels.size() < switches)
    t.fail(key, fmt::format("{} channels (allowed: one for each of {})", c.switch_channels.size(), switches));
  c.watchdog_channel = t.integer_or("watchdog", c.watchdog_channel, -1, most_channels);
  std::set<int> channels(c.switch_channels.begin(), c.switch_channels.end());
  if (channels.size() != c.switch_channels.size() || channels.contains(c.watchdog_channel))
    t.fail(key, "a channel is there twice (allowed: one channel each, none of them the watchdog's)");
  t.finish();
}

ComediSettings usual_comedi(const VariantConfig& variant) {
  const SystemDescription& system = system_of(variant).description_for(variant);
  const ModeSet modes = system_of(variant).modes(variant);
  ComediSettings c;
  c.input_channels.resize(system.channels.size());
  std::iota(c.input_channels.begin(), c.input_channels.end(), 0);
  for (std::size_t i = 0; i < system.continuous.size(); ++i) c.outputs.push_back({1, static_cast<int>(i), 0});
  c.switch_channels.resize(static_cast<std::size_t>(modes.switch_count()));
  std::iota(c.switch_channels.begin(), c.switch_channels.end(), 0);
  c.safe_switches = modes.safe_pattern();
  return c;
}

void read_comedi(TableReader& table, const VariantConfig& variant, ComediSettings& c) {
  const SystemDescription& system = system_of(variant).description_for(variant);
  c.device = table.text_or("device", c.device);
  if (table.has("inputs")) {
    TableReader inner = table.table("inputs");
    read_inputs(inner, system, c);
  }
  for (std::size_t i = 0; i < c.outputs.size(); ++i) {
    if (!table.has(system.continuous[i].name)) continue;
    TableReader inner = table.table(system.continuous[i].name);
    read_output(inner, c.outputs[i]);
  }
  if (table.has(system.modes_key)) {
    TableReader inner = table.table(system.modes_key);
    const int switches = system_of(variant).modes(variant).switch_count();
    read_switches(inner, system.switches_key, static_cast<std::size_t>(switches), c);
  }
  table.finish();
}

/// A quantity may move by a whole step of its converter before it shows another value: the model must have moved it by
/// twice that.
void watch_through(SensorBounds& bounds, double step) {
  if (bounds.stuck_change > 0) bounds.stuck_change = std::max(bounds.stuck_change, 2 * step);
}

/// A channel that the system's own rig watches by its noise is watched by the noise stated, and never more hastily.
void watch_for(SensorBounds& bounds, const ChannelNoise& noise) {
  watch_through(bounds, noise.quantum);
  if (bounds.stuck_ticks == 0) return;
  const int ticks = stuck_ticks_of(noise);
  bounds.stuck_ticks = ticks > 0 ? std::max(ticks, bounds.stuck_ticks) : 0;
}

void read_node(TableReader& table, NodeSettings& node) {
  node.address = table.text_or("address", node.address);
  node.key_file = table.text_or("key_file", node.key_file);
  if (!node.key_file.empty()) node.key_file = table.document().beside(node.key_file);
  table.finish();
}

/// Limits of the channels, by the names that they have in a rig's file.
void read_channel_limits(TableReader& t, const SystemDescription& system, LadderSettings& l) {
  for (std::size_t i = 0; i < system.channels.size(); ++i) {
    const SensorBounds& bounds = l.plausibility.channels[i];
    const Range range{bounds.rail_low, bounds.rail_high};
    const std::string name = system.channels[i].name;
    l.limits[i].low = t.number_or(name + "_low", l.limits[i].low, range);
    l.limits[i].high = t.number_or(name + "_high", l.limits[i].high, range);
    if (l.limits[i].low >= l.limits[i].high)
      t.fail(name + "_high", fmt::format("not above {}_low (allowed: a range of positive length)", name));
  }
}

/// The actuator's have names of their own.
void read_actuator_limits(TableReader& t, LadderSettings& l) {
  ChannelLimits& position = l.limits[position_channel];
  position.low = t.number_or("position_low_m", position.low, Range::between(-0.01, 0.2));
  position.high = t.number_or("position_high_m", position.high, Range::between(-0.01, 0.2));
  if (position.low >= position.high)
    t.fail("position_high_m", "not above position_low_m (allowed: a range of positive length)");
  const double most_pa = t.number_or("pressure_limit_pa", l.limits[pressure_a_channel].high, Range::between(1e5, 1e6));
  for (const std::size_t channel : pressure_channels) l.limits[channel].high = most_pa;
}

/// What keys of ladder and exit are called.
struct LimitKeys {
  const char *held_slots = "held_slots", *backup_slots = "backup_slots", *continuous_per_tick = "continuous_per_tick",
             *switch_period_ticks = "switch_period_ticks";
};
constexpr LimitKeys actuator_keys = {"dmpc_slots", "motor_slots", "motor_n_per_tick", "coil_period_ticks"};

void read_limits(TableReader& t, const VariantConfig& variant, RigFile& rig) {
  const SystemDescription& system = system_of(variant).description_for(variant);
  const bool of_actuator = system.name == actuator_description().name;
  const LimitKeys keys = of_actuator ? actuator_keys : LimitKeys{};
  LadderSettings& l = rig.ladder;
  if (of_actuator)
    read_actuator_limits(t, l);
  else if (!l.limits.empty())
    read_channel_limits(t, system, l);
  l.lowering_s = t.number_or("lowering_s", l.lowering_s, Range::between(0.0, 5.0));
  l.shifted_slots = t.integer_or("shifted_slots", l.shifted_slots, 0, 20);
  l.held_slots = t.integer_or(keys.held_slots, l.held_slots, 0, 100000);
  l.backup_slots = t.integer_or(keys.backup_slots, l.backup_slots, 0, 2000);
  if (t.has("longest_gap_ms")) {
    const double ticks = 1e-3 * t.integer("longest_gap_ms", 1, 1000) / variant.timing.tick_s;
    l.longest_gap_ticks = std::max(1, static_cast<int>(std::lround(ticks)));
  }
  if (!system.continuous.empty())
    rig.rates.continuous_per_tick =
        t.number_or(keys.continuous_per_tick, rig.rates.continuous_per_tick, Range::positive());
  rig.rates.switch_period_ticks = t.integer_or(keys.switch_period_ticks, rig.rates.switch_period_ticks, 0, 1000);
  t.finish();
}

}  // namespace

RigFile usual_rig(const VariantConfig& variant) {
  RigFile rig;
  rig.calibration = usual_calibration(variant);
  rig.comedi = usual_comedi(variant);
  rig.ladder = system_of(variant).ladder(variant);
  require_complete(rig.ladder, system_of(variant).description_for(variant));
  return rig;
}

RigFile read_rig_file(const std::string& path, const VariantConfig& variant) {
  RigFile rig = read_rig(TableReader::from_file(path), variant);
  rig.text = read_whole_file(path).value_or("");
  return rig;
}

RigFile read_rig(TableReader table, const VariantConfig& variant) {
  RigFile rig = usual_rig(variant);
  if (table.has("calibration")) {
    TableReader calibration = table.table("calibration");
    rig.calibration = read_calibration(calibration, variant);
    for (std::size_t i = 0; i < rig.calibration.noise.size(); ++i) {
      SensorBounds& bounds = rig.ladder.plausibility.channels[i];
      if (const auto& noise = rig.calibration.noise[i])
        watch_for(bounds, *noise);
      else
        watch_through(bounds, converter_step(rig.calibration.channels[i].gain));
    }
  }
  if (table.has("comedi")) {
    TableReader comedi = table.table("comedi");
    read_comedi(comedi, variant, rig.comedi);
  }
  if (table.has("node")) {
    TableReader node = table.table("node");
    read_node(node, rig.node);
  }
  if (table.has("limits")) {
    TableReader limits = table.table("limits");
    read_limits(limits, variant, rig);
  }
  table.finish();
  return rig;
}

void expect_noise(RigFile& rig, const std::vector<ChannelNoise>& of_plant) {
  for (std::size_t i = 0; i < std::min(of_plant.size(), rig.calibration.noise.size()); ++i)
    if (!rig.calibration.noise[i]) watch_for(rig.ladder.plausibility.channels[i], of_plant[i]);
}

}  // namespace solenoid
