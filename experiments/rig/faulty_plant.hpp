#pragma once

#include "experiments/plants/simulated_plant.hpp"
#include "experiments/rig/fault_script.hpp"

#include <array>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace solenoid {

/// A simulated plant whose sensors and actuation fail by script. A sensor that is off shows the middle of its converter;
/// garbage is anywhere in its range.
class FaultyPlant final : public SimulatedPlant {
 public:
  /// `variant`: of the controller, told of the scenario.
  FaultyPlant(std::unique_ptr<SimulatedPlant> plant, std::vector<InjectedFault> faults, const VariantConfig& variant,
              std::uint64_t seed);

  Measurement read(double time_s) noexcept override;
  void write(const Command& command) noexcept override;
  double consumed() const override { return plant_->consumed(); }

  /// What reached the switches and continuous inputs.
  const Command& outputs() const { return outputs_; }

 private:
  static constexpr std::size_t history = 512;
  struct Channel {
    double held = 0.0, slow = 0.0, low = 0.0, high = 0.0;
    bool frozen = false;
    std::array<double, history> past{};
  };
  double spoiled(const InjectedFault& fault, Channel& channel, double value, double time_s) noexcept;

  std::unique_ptr<SimulatedPlant> plant_;
  std::vector<InjectedFault> faults_;
  VariantConfig variant_;
  const SimulatedSystem& system_;
  std::vector<std::string> names_;
  std::vector<Channel> channels_;
  std::mt19937_64 random_;
  Command outputs_;
  double tick_s_;
  double time_s_ = 0.0;
  std::size_t tick_ = 0;
};

}  // namespace solenoid
