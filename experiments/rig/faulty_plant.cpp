#include "experiments/rig/faulty_plant.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double longest_delay_ticks = 1e6;
constexpr double longest_late_s = 0.05;  // of a slow switch

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
  for (std::size_t i = 0; i < faults_.size(); ++i)
    for (const ActuationFault& known : system_.actuation_faults()) {
      if (faults_[i].kind != known.kind) continue;
      if (known.of_switch != SwitchFaultKind::none && faults_[i].target.starts_with(known.target + "_"))
        find_switch(i, known);
      else if (known.of_switch == SwitchFaultKind::none && faults_[i].target == known.target)
        check_known(i, known);
    }
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

/// A fault that is not of a switch must be one that this mode set can have, by a value that can be.
void FaultyPlant::check_known(std::size_t index, const ActuationFault& known) {
  const InjectedFault& fault = faults_[index];
  const std::string name = system_.system().modes(variant_).name();
  if (!known.needs.empty() && (" " + known.needs + " ").find(" " + name + " ") == std::string::npos)
    throw ConfigError(fmt::format("fault '{}:{}': '{}' cannot have it (allowed with: {})", fault.target, fault.kind,
                                  name, known.needs));
  if (!known.unit.empty() && !(fault.value > 0.0 && fault.value <= known.most))
    throw ConfigError(fmt::format("fault '{}:{}': {} is not its {} (allowed: above 0, up to {:g})", fault.target,
                                  fault.kind, fault.value, known.unit, known.most));
  if (known.of_plant) of_parts_.push_back({index});
}

/// Notes which of them act now; whether any began or ended.
template <class Of>
bool FaultyPlant::turned(std::vector<Of>& all, double time_s) const noexcept {
  bool changed = false;
  for (Of& of : all) {
    const bool acts = faults_[of.index].active(time_s);
    changed = changed || acts != of.acts;
    of.acts = acts;
  }
  return changed;
}

/// Of several faults of one part the script's last that acts counts.
void FaultyPlant::fail_parts(double time_s) noexcept {
  if (!turned(of_parts_, time_s)) return;
  for (const OfPart& of : of_parts_)
    if (!of.acts) plant_->fail_part(faults_[of.index].target, std::nullopt);
  for (const OfPart& of : of_parts_)
    if (of.acts) plant_->fail_part(faults_[of.index].target, faults_[of.index].value);
}

/// Finds the switch that a script names among the variant's.
void FaultyPlant::find_switch(std::size_t index, const ActuationFault& known) {
  const InjectedFault& fault = faults_[index];
  const auto refuse = [&](const std::string& problem) {
    throw ConfigError(fmt::format("fault '{}:{}': {}", fault.target, fault.kind, problem));
  };
  const double most = known.of_switch == SwitchFaultKind::leaking ? 1.0 : longest_late_s;
  if (!known.unit.empty() && !(fault.value > 0.0 && fault.value <= most))
    refuse(fmt::format("{} is not its {} (allowed: above 0, up to {:g})", fault.value, known.unit, most));
  const ModeSet modes = system_.system().modes(variant_);
  std::string allowed;
  for (std::size_t c = 0; c < modes.switches().size(); ++c) {
    const std::string name = script_name(known, modes.switches()[c]);
    if (name == fault.target) {
      of_switches_.push_back({index, c, {known.of_switch, fault.value}});
      return;
    }
    allowed += (allowed.empty() ? "" : ", ") + name;
  }
  refuse(allowed.empty() ? fmt::format("'{}' has no switches", modes.name())
                         : fmt::format("'{}' has no such switch (allowed: {})", modes.name(), allowed));
}

/// Of several faults of one switch the script's last that acts counts.
void FaultyPlant::fail_switches(double time_s) noexcept {
  if (!turned(of_switches_, time_s)) return;
  for (const OfSwitch& of : of_switches_)
    if (!of.acts) plant_->fail_switch(of.c, {});
  for (const OfSwitch& of : of_switches_)
    if (of.acts) plant_->fail_switch(of.c, of.fault);
}

double FaultyPlant::spoiled(const InjectedFault& fault, Channel& c, double value, double time_s) noexcept {
  const double off = (c.low + c.high) / 2;
  if (fault.kind == "off") return off;
  if (fault.kind == "stuck") return c.held;
  if (fault.kind == "garbage") return std::uniform_real_distribution<double>(c.low, c.high)(random_);
  if (fault.kind == "offset") return value + fault.value;
  if (fault.kind == "inverted") return 2 * off - value;
  if (fault.kind == "gain") return off + fault.value * (value - off);
  if (fault.kind == "slow") return c.slow += (value - c.slow) * std::min(1.0, tick_s_ / fault.value);
  if (fault.kind == "delayed") return c.past[(tick_ - std::min(ticks_of(fault), tick_)) % c.past.size()];
  return std::fmod(time_s - fault.from_s, fault.value) < 0.1 * fault.value ? off : value;  // intermittent
}

/// What the wires of two sensors say when they are exchanged, each read as the other's: the same share of its range.
void FaultyPlant::swap_sensors(ChannelValues& values, double time_s) noexcept {
  for (const InjectedFault& fault : faults_) {
    if (fault.kind != "swapped" || !fault.active(time_s)) continue;
    const auto at = std::ranges::find(names_, fault.target);
    if (at == names_.end()) continue;
    const auto i = static_cast<std::size_t>(at - names_.begin()), j = static_cast<std::size_t>(fault.value);
    const auto as = [](double value, const Channel& from, const Channel& to) {
      return to.low + (value - from.low) * ((to.high - to.low) / (from.high - from.low));
    };
    const double first = values[i];
    values[i] = as(values[j], channels_[j], channels_[i]);
    values[j] = as(first, channels_[i], channels_[j]);
  }
}

Measurement FaultyPlant::read(double time_s) noexcept {
  time_s_ = time_s;
  tick_ = static_cast<std::size_t>(std::llround(std::max(0.0, time_s) / tick_s_));
  Measurement s = plant_->read(time_s);
  fail_switches(time_s);
  fail_parts(time_s);
  ChannelValues& values = s.value;
  swap_sensors(values, time_s);
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    Channel& c = channels_[i];
    c.past[tick_ % c.past.size()] = values[i];
    bool any = false;
    for (const InjectedFault& fault : faults_) {
      if (fault.target != names_[i] || fault.kind == "swapped" || !fault.active(time_s)) continue;
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
      if (known.of_switch == SwitchFaultKind::none && !known.of_plant && fault.target == known.target &&
          fault.kind == known.kind)
        reached = system_.spoiled(variant_, known, reached, outputs_);
  }
  outputs_ = reached;
  plant_->write(reached);
}

}  // namespace solenoid
