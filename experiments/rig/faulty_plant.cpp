#include "experiments/rig/faulty_plant.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double longest_delay_ticks = 1e6;

}  // namespace

FaultyPlant::FaultyPlant(std::unique_ptr<SimulatedPlant> plant, std::vector<InjectedFault> faults,
                         const VariantConfig& variant, std::uint64_t seed)
    : plant_(std::move(plant)),
      faults_(std::move(faults)),
      variant_(variant),
      system_(simulation_of(solenoid::system_of(variant))),
      random_(seed),
      tick_s_(variant.timing.tick_s) {
  const System& system = system_.system();
  const LadderSettings usual = system.ladder(variant);
  outputs_.switches = system.modes(variant).safe_pattern();
  std::size_t history = 1;
  for (const InjectedFault& fault : faults_) {
    if (fault.kind != "delayed") continue;
    if (!(fault.value / tick_s_ <= longest_delay_ticks))
      throw ConfigError(fmt::format("fault '{}:delayed={:g}': a delay of {:g} ticks of {:g} ms (allowed: at most {:g})",
                                    fault.target, fault.value, fault.value / tick_s_, 1e3 * tick_s_,
                                    longest_delay_ticks));
    history = std::max(history, ticks_of(fault) + 1);
  }
  for (std::size_t i = 0; i < system.description().channels.size(); ++i) {
    names_.push_back(system.description().channels[i].name);
    channels_.emplace_back();
    channels_.back().past.resize(history);
    channels_.back().low = usual.plausibility.channels[i].rail_low;
    channels_.back().high = usual.plausibility.channels[i].rail_high;
  }
}

double FaultyPlant::spoiled(const InjectedFault& fault, Channel& c, double value, double time_s) noexcept {
  const double off = (c.low + c.high) / 2;
  if (fault.kind == "off") return off;
  if (fault.kind == "stuck") return c.held;
  if (fault.kind == "garbage") return std::uniform_real_distribution<double>(c.low, c.high)(random_);
  if (fault.kind == "offset") return value + fault.value;
  if (fault.kind == "slow") return c.slow += (value - c.slow) * std::min(1.0, tick_s_ / fault.value);
  if (fault.kind == "delayed") return c.past[(tick_ - std::min(ticks_of(fault), tick_)) % c.past.size()];
  return std::fmod(time_s - fault.from_s, fault.value) < 0.1 * fault.value ? off : value;  // intermittent
}

Measurement FaultyPlant::read(double time_s) noexcept {
  time_s_ = time_s;
  tick_ = static_cast<std::size_t>(std::llround(std::max(0.0, time_s) / tick_s_));
  Measurement s = plant_->read(time_s);
  ChannelValues& values = s.value;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    Channel& c = channels_[i];
    c.past[tick_ % c.past.size()] = values[i];
    bool any = false;
    for (const InjectedFault& fault : faults_) {
      if (fault.target != names_[i] || !fault.active(time_s)) continue;
      values[i] = spoiled(fault, c, values[i], time_s);
      any = true;
    }
    if (!any) c.held = c.slow = values[i];
  }
  return s;
}

void FaultyPlant::write(const Command& command) noexcept {
  Command reached = command;
  for (const InjectedFault& fault : faults_) {
    if (!fault.active(time_s_)) continue;
    for (const ActuationFault& known : system_.actuation_faults())
      if (fault.target == known.target && fault.kind == known.kind)
        reached = system_.spoiled(variant_, known, reached, outputs_);
  }
  outputs_ = reached;
  plant_->write(reached);
}

}  // namespace solenoid
