#pragma once

#include <optional>
#include <string>

namespace solenoid {

/// What a valve configuration is built of (experiments/systems/actuator/data/parts/valves.toml, with sources).
struct ValveHardware {
  int valves = 0;
  double price_usd = 0.0;  ///< of the valves alone
  std::optional<double>
      rated_changes{};  ///< of the part that lasts least: switchings of a coil, on and off counted each
};

/// Nothing is known, no valve and no price, of a configuration that the file does not have: a plug-in's own.
const ValveHardware& valve_hardware(const std::string& configuration);

/// Years of uninterrupted running until the rated life of a coil ends that changes so often, at most 1000; 0 where
/// nothing switches.
double life_years(const ValveHardware& hardware, double changes_per_s);

}  // namespace solenoid
