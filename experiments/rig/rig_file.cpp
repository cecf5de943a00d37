#include "experiments/rig/rig_file.hpp"

#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/files.hpp"

#include <set>

namespace solenoid {
namespace {

constexpr int most_channels = 31;  // of one masked write

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

void read_limits(TableReader& t, RigFile& rig) {
  LadderSettings& l = rig.ladder;
  ChannelLimits& position = l.limits[position_channel];
  position.low = t.number_or("position_low_m", position.low, Range::between(-0.01, 0.2));
  position.high = t.number_or("position_high_m", position.high, Range::between(-0.01, 0.2));
  if (position.low >= position.high)
    t.fail("position_high_m", "not above position_low_m (allowed: a range of positive length)");
  const double most_pa = t.number_or("pressure_limit_pa", l.limits[pressure_a_channel].high, Range::between(1e5, 1e6));
  for (const std::size_t channel : pressure_channels) l.limits[channel].high = most_pa;
  l.lowering_s = t.number_or("lowering_s", l.lowering_s, Range::between(0.0, 5.0));
  l.shifted_slots = t.integer_or("shifted_slots", l.shifted_slots, 0, 20);
  l.dmpc_slots = t.integer_or("dmpc_slots", l.dmpc_slots, 0, 100000);
  l.motor_slots = t.integer_or("motor_slots", l.motor_slots, 0, 2000);
  l.longest_gap_ticks = t.integer_or("longest_gap_ms", l.longest_gap_ticks, 1, 1000);
  rig.rates.continuous_per_tick = t.number_or("motor_n_per_tick", rig.rates.continuous_per_tick, Range::positive());
  rig.rates.switch_period_ticks = t.integer_or("coil_period_ticks", rig.rates.switch_period_ticks, 0, 1000);
  t.finish();
}

}  // namespace

RigFile read_rig_file(const std::string& path) {
  RigFile rig = read_rig(TableReader::from_file(path));
  rig.text = read_whole_file(path).value_or("");
  return rig;
}

RigFile read_rig(TableReader table) {
  RigFile rig;
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
    read_limits(limits, rig);
  }
  table.finish();
  return rig;
}

}  // namespace solenoid
