#include "experiments/rig/faulty_plant.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {
namespace {

constexpr std::array<const char*, 3> names = {"position", "pressure_a", "pressure_b"};
constexpr double atmosphere_pa = 101325.0, span_pa = 210e3;

}  // namespace

FaultyPlant::FaultyPlant(std::unique_ptr<SimulatedPlant> plant, std::vector<InjectedFault> faults,
                         const std::string& valves, std::uint64_t seed, double tick_s)
    : plant_(std::move(plant)),
      faults_(std::move(faults)),
      supply_coils_(valves == "three_way" ? 0b11u : 0b0101u),
      coils_a_chamber_(valves == "three_way" ? 1 : 2),
      random_(seed),
      tick_s_(tick_s) {
  channels_[0].low = -0.01, channels_[0].high = 0.11;
  for (const std::size_t i : {1u, 2u})
    channels_[i].low = atmosphere_pa - span_pa, channels_[i].high = atmosphere_pa + span_pa;
}

double FaultyPlant::spoiled(const InjectedFault& fault, Channel& c, double value, double time_s) noexcept {
  const double off = (c.low + c.high) / 2;
  if (fault.kind == "off") return off;
  if (fault.kind == "stuck") return c.held;
  if (fault.kind == "garbage") return std::uniform_real_distribution<double>(c.low, c.high)(random_);
  if (fault.kind == "offset") return value + fault.value;
  if (fault.kind == "slow") return c.slow += (value - c.slow) * std::min(1.0, tick_s_ / fault.value);
  if (fault.kind == "delayed") {
    const auto ago = static_cast<std::size_t>(std::clamp(std::round(fault.value / tick_s_), 0.0, history - 1.0));
    return c.past[(tick_ + history - std::min(ago, tick_)) % history];
  }
  return std::fmod(time_s - fault.from_s, fault.value) < 0.1 * fault.value ? off : value;  // intermittent
}

Measurement FaultyPlant::read(double time_s) noexcept {
  time_s_ = time_s;
  tick_ = static_cast<std::size_t>(std::llround(std::max(0.0, time_s) / tick_s_));
  Measurement s = plant_->read(time_s);
  ChannelValues& values = s.value;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    Channel& c = channels_[i];
    c.past[tick_ % history] = values[i];
    bool any = false;
    for (const InjectedFault& fault : faults_) {
      if (fault.target != names[i] || !fault.active(time_s)) continue;
      values[i] = spoiled(fault, c, values[i], time_s);
      any = true;
    }
    if (!any) c.held = c.slow = values[i];
  }
  return s;
}

void FaultyPlant::write(const Command& command) noexcept {
  Command reached = command;
  const SwitchPattern chamber = (SwitchPattern{1} << coils_a_chamber_) - 1;
  for (const InjectedFault& fault : faults_) {
    if (!fault.active(time_s_)) continue;
    if (fault.target == "valves" && fault.kind == "stuck") reached.switches = outputs_.switches;
    if (fault.target == "valves" && fault.kind == "swapped")
      reached.switches =
          ((reached.switches & chamber) << coils_a_chamber_) | ((reached.switches >> coils_a_chamber_) & chamber);
    if (fault.target == "supply") reached.switches &= ~supply_coils_;
  }
  outputs_ = reached;
  plant_->write(reached);
}

}  // namespace solenoid
