#pragma once

#include "experiments/plants/simulated_plant.hpp"
#include "experiments/rig/fault_script.hpp"

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace solenoid {

/// A simulated plant whose sensors and actuation fail by script. A sensor that is off shows the middle of its converter;
/// garbage is anywhere in its range; inverted it shows the other side of that middle.
class FaultyPlant final : public SimulatedPlant {
 public:
  /// `variant`: of the controller, told of the scenario. Throws ConfigError for a delay of more than a million ticks, for
  /// a switch that the variant does not have, for a value that cannot be.
  FaultyPlant(std::unique_ptr<SimulatedPlant> plant, std::vector<InjectedFault> faults, const VariantConfig& variant,
              std::uint64_t seed);

  Measurement read(double time_s) noexcept override;
  void write(const Command& command) noexcept override;
  double consumed() const override { return plant_->consumed(); }

  /// What reached the switches and continuous inputs.
  const Command& outputs() const { return outputs_; }

 private:
  struct Channel {
    double held = 0.0, slow = 0.0, low = 0.0, high = 0.0;
    std::vector<double> past{};  ///< the newest values, one a tick, in turn
  };
  std::size_t ticks_of(const InjectedFault& fault) const {
    return static_cast<std::size_t>(std::llround(fault.value / tick_s_));
  }
  /// A fault of one switch, and whether the plant has it now.
  struct OfSwitch {
    std::size_t index;  ///< of the fault
    std::size_t c;
    SwitchFault fault;
    bool acts = false;
  };
  /// A fault of a part of the plant's own.
  struct OfPart {
    std::size_t index;  ///< of the fault
    bool acts = false;
  };
  double spoiled(const InjectedFault& fault, Channel& channel, double value, double time_s) noexcept;
  void find_switch(std::size_t index, const ActuationFault& known);
  void check_known(std::size_t index, const ActuationFault& known);
  template <class Of>
  bool turned(std::vector<Of>& all, double time_s) const noexcept;
  void fail_switches(double time_s) noexcept;
  void fail_parts(double time_s) noexcept;
  void swap_sensors(ChannelValues& values, double time_s) noexcept;

  std::unique_ptr<SimulatedPlant> plant_;
  std::vector<InjectedFault> faults_;
  VariantConfig variant_;
  const SimulatedSystem& system_;
  std::vector<std::string> names_;
  std::vector<Channel> channels_;
  std::vector<OfSwitch> of_switches_;
  std::vector<OfPart> of_parts_;
  std::mt19937_64 random_;
  Command outputs_;
  double tick_s_;
  double time_s_ = 0.0;
  std::size_t tick_ = 0;
};

}  // namespace solenoid
