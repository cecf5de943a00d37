#include "experiments/rig/calibration.hpp"

#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/rig/rig_guard.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr double full_scale_v = 5.0;
constexpr Range limits_v{0.0, 10.0, true};

void read_line(TableReader& inner, LinearChannel& channel) {
  channel.offset = inner.number_or("offset", channel.offset);
  channel.gain = inner.number_or("gain", channel.gain);
  if (channel.gain == 0.0) inner.fail("gain", "is 0 (allowed: any other number)");
}

void read_output(TableReader& table, const std::string& key, LinearOutput& output) {
  if (!table.has(key)) return;
  TableReader inner = table.table(key);
  read_line(inner, output);
  inner.finish();
}

/// What a channel's noise is, if the file says so: `noise_v` before a converter of `bits` over -5 to 5 V.
/// Refused of a channel that no noise tells stuck: `watched` names those that are.
std::optional<ChannelNoise> read_channel(TableReader& table, const std::string& key,
                                         const std::vector<std::string>& watched, LinearChannel& channel) {
  if (!table.has(key)) return std::nullopt;
  TableReader inner = table.table(key);
  read_line(inner, channel);
  std::optional<ChannelNoise> noise;
  for (const char* stated : {"noise_v", "bits"})
    if (inner.has(stated) && std::ranges::find(watched, key) == watched.end())
      inner.fail(stated, fmt::format("{} is not told stuck by its noise (allowed of: {})", key,
                                     watched.empty() ? "no channel" : fmt::format("{}", fmt::join(watched, ", "))));
  if (inner.has("noise_v")) {
    const double sigma_v = inner.number("noise_v", Range::between(0.0, full_scale_v));
    const int bits = inner.has("bits") ? inner.integer("bits", 1, 32) : usual_converter_bits;
    noise = {std::abs(channel.gain) * sigma_v, converter_step(channel.gain, bits)};
  } else if (inner.has("bits")) {
    inner.fail("bits", "says nothing without the noise before the converter (allowed: with noise_v)");
  }
  inner.finish();
  return noise;
}

}  // namespace

std::string IoHealth::text() const {
  return fmt::format("{} reads, {} missed, {} late, {} corrupt, {} write errors, {} timeouts of the node{}{}", reads,
                     missed, late, corrupt, write_errors, node_timeouts,
                     asked > 0 ? fmt::format("; another controller asked for the node {} times, in vain", asked) : "",
                     displaced ? "; the node is no longer this controller's" : "");
}

double WireHealth::jitter_us() const { return std::max(0.0, round_trip_us.p99 - least_round_trip_us) / 2; }

double WireHealth::loss() const {
  return answered + lost > 0 ? static_cast<double>(lost) / static_cast<double>(answered + lost) : 0.0;
}

std::string WireHealth::text() const {
  return fmt::format(
      "round trip p50 {:.0f}, p99 {:.0f}, max {:.0f} us; jitter {:.0f} us; {:.2f} % lost, {} overtaken; age p99 {:.0f} "
      "+- {:.0f} us; the node's clock {:+.1f} ppm",
      round_trip_us.p50, round_trip_us.p99, round_trip_us.max, jitter_us(), 100 * loss(), reordered, age_us.p99,
      clock_error_us, drift_ppm);
}

double converter_step(double gain, int bits) { return std::abs(gain) * 2 * full_scale_v / std::ldexp(1.0, bits); }

Calibration usual_calibration(const VariantConfig& variant) {
  const System& system = system_of(variant);
  Calibration c;
  for (const SensorBounds& bounds : system.ladder(variant).plausibility.channels)
    c.channels.push_back(
        {(bounds.rail_low + bounds.rail_high) / 2, (bounds.rail_high - bounds.rail_low) / (2 * full_scale_v)});
  c.noise.resize(c.channels.size());
  for (const double most : system.continuous_limits(variant))
    c.continuous.push_back({{0.0, most / full_scale_v}, full_scale_v});
  return c;
}

Calibration read_calibration(TableReader& table, const VariantConfig& variant) {
  const SystemDescription& system = system_of(variant).description_for(variant);
  Calibration c = usual_calibration(variant);
  const std::vector<SensorBounds> bounds = system_of(variant).ladder(variant).plausibility.channels;
  std::vector<std::string> watched;
  for (std::size_t i = 0; i < bounds.size(); ++i)
    if (bounds[i].stuck_ticks > 0) watched.push_back(system.channels[i].name);
  for (std::size_t i = 0; i < c.channels.size(); ++i)
    c.noise[i] = read_channel(table, system.channels[i].name, watched, c.channels[i]);
  for (std::size_t i = 0; i < c.continuous.size(); ++i) {
    const std::string& name = system.continuous[i].name;
    read_output(table, name, c.continuous[i]);
    c.continuous[i].limit_v = table.number_or(name + "_limit_v", c.continuous[i].limit_v, limits_v);
  }
  table.finish();
  return c;
}

RigPlant::RigPlant(std::unique_ptr<RigIo> io, const Calibration& calibration, const VariantConfig& variant)
    : io_(std::move(io)), calibration_(calibration), tick_s_(variant.timing.tick_s) {
  const SystemDescription& system = system_of(variant).description_for(variant);
  for (std::size_t s = 0; s < system.states.size(); ++s)
    for (std::size_t c = 0; c < system.channels.size(); ++c)
      if (system.states[s].name == system.channels[c].name) shown_.push_back({s, c});
  io_->open();
}

RigPlant::~RigPlant() { io_->safe(); }

Measurement RigPlant::read(double time_s) noexcept {
  const RigInputs in = io_->read();
  const double elapsed = last_time_s_ < 0 ? 1.0 : std::round((time_s - last_time_s_) / tick_s_);
  stale_ticks_ = in.fresh ? 0 : stale_ticks_ + std::max(1, static_cast<int>(std::min(elapsed, 1e6)));
  last_time_s_ = time_s;
  Measurement s;
  s.time_s = time_s;
  for (std::size_t i = 0; i < calibration_.channels.size(); ++i)
    s.value[i] = calibration_.channels[i].value(in.volts[i]);
  for (const Shown& shown : shown_) s.truth[shown.state] = s.value[shown.channel];
  s.stale_ticks = stale_ticks_;
  s.node_was_safe = in.node_was_safe;
  s.age_s = in.age_s;
  return s;
}

void RigPlant::write(const Command& command) noexcept {
  if (RigGuard::crashing()) return;
  RigOutputs outputs{{}, command.switches};
  for (std::size_t i = 0; i < calibration_.continuous.size(); ++i) {
    const LinearOutput& output = calibration_.continuous[i];
    outputs.volts[i] = std::clamp(output.volts(command.continuous[i]), -output.limit_v, output.limit_v);
  }
  io_->write(outputs);
}

}  // namespace solenoid
