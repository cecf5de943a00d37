#include "experiments/rig/rig_file.hpp"

#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/files.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr int most_channels = 31;  // of one masked write

/// Boards and nodes, with their calibration, are the actuator's.
bool is_of_rig(const System& system) { return system.name() == actuator_description().name; }

void read_inputs(TableReader& t, ComediSettings& c) {
  c.input_subdevice = t.integer_or("subdevice", c.input_subdevice, 0, 63);
  c.position_channel = t.integer_or("position", c.position_channel, 0, 255);
  c.pressure_a_channel = t.integer_or("pressure_a", c.pressure_a_channel, 0, 255);
  c.pressure_b_channel = t.integer_or("pressure_b", c.pressure_b_channel, 0, 255);
  c.input_range = t.integer_or("range", c.input_range, 0, 31);
  c.reference = t.text_or("reference", c.reference, {"ground", "common", "diff"});
  t.finish();
}

void read_motor(TableReader& t, ComediSettings& c) {
  c.output_subdevice = t.integer_or("subdevice", c.output_subdevice, 0, 63);
  c.motor_channel = t.integer_or("channel", c.motor_channel, 0, 255);
  c.output_range = t.integer_or("range", c.output_range, 0, 31);
  t.finish();
}

void read_valves(TableReader& t, ComediSettings& c) {
  c.digital_subdevice = t.integer_or("subdevice", c.digital_subdevice, 0, 63);
  if (t.has("coils")) c.coil_channels = t.integers("coils", 0, most_channels);
  c.watchdog_channel = t.integer_or("watchdog", c.watchdog_channel, -1, most_channels);
  std::set<int> channels(c.coil_channels.begin(), c.coil_channels.end());
  if (channels.size() != c.coil_channels.size() || channels.contains(c.watchdog_channel))
    t.fail("coils", "a channel is there twice (allowed: one channel a coil, none of them the watchdog's)");
  t.finish();
}

ComediSettings read_comedi(TableReader& table) {
  ComediSettings c;
  c.device = table.text_or("device", c.device);
  const auto section = [&](const char* key, void (*read)(TableReader&, ComediSettings&)) {
    if (!table.has(key)) return;
    TableReader inner = table.table(key);
    read(inner, c);
  };
  section("inputs", read_inputs);
  section("motor", read_motor);
  section("valves", read_valves);
  table.finish();
  return c;
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
  const SystemDescription& system = system_of(variant).description();
  const bool of_rig = is_of_rig(system_of(variant));
  const LimitKeys keys = of_rig ? actuator_keys : LimitKeys{};
  LadderSettings& l = rig.ladder;
  if (of_rig)
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
  rig.ladder = system_of(variant).ladder(variant);
  require_complete(rig.ladder, system_of(variant).description());
  return rig;
}

RigFile read_rig_file(const std::string& path, const VariantConfig& variant) {
  RigFile rig = read_rig(TableReader::from_file(path), variant);
  rig.text = read_whole_file(path).value_or("");
  return rig;
}

RigFile read_rig(TableReader table, const VariantConfig& variant) {
  const System& system = system_of(variant);
  RigFile rig = usual_rig(variant);
  for (const char* key : {"calibration", "comedi"})
    if (!is_of_rig(system) && table.has(key))
      table.fail(key, fmt::format("of the actuator's rig, not of {} (allowed: limits)", system.name()));
  if (table.has("calibration")) {
    TableReader calibration = table.table("calibration");
    rig.calibration = read_calibration(calibration);
  }
  if (table.has("comedi")) {
    TableReader comedi = table.table("comedi");
    rig.comedi = read_comedi(comedi);
  }
  if (table.has("limits")) {
    TableReader limits = table.table("limits");
    read_limits(limits, variant, rig);
  }
  table.finish();
  return rig;
}

}  // namespace solenoid
