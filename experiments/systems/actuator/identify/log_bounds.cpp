#include "experiments/systems/actuator/identify/log_bounds.hpp"

#include "core/systems/actuator/parameters.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double strokes = 2.0;   // from 0, wherever 0 is
constexpr double supplies = 5.0;  // of absolute pressure
constexpr double motor_limits = 5.0;

/// Where a number of a log may be; one a thousand times too large, being in another unit, is not.
struct PlausibleRange {
  std::string_view name, unit;
  double low, high;
  std::string_view otherwise;  ///< the source for --column of what is in another unit
};

const std::array<PlausibleRange, 4>& plausible_ranges() {
  static const auto all = [] {
    const ActuatorParameters p;
    const double way = strokes * (p.position_max_m() - p.position_min_m());
    const double pressure = supplies * p.supply_pressure_pa, force = motor_limits * p.motor_force_limit_n();
    return std::array<PlausibleRange, 4>{{
        {"position_m", "m", -way, way, "HEADING*FACTOR+OFFSET"},
        {"pressure_a_pa", "Pa", 0.0, pressure, "HEADING*FACTOR, of gauge pressure HEADING*FACTOR+101325"},
        {"pressure_b_pa", "Pa", 0.0, pressure, "HEADING*FACTOR, of gauge pressure HEADING*FACTOR+101325"},
        {"motor_n", "N", -force, force, "HEADING*FACTOR"},
    }};
  }();
  return all;
}

}  // namespace

std::optional<std::string> implausible(std::string_view name, double value) {
  const auto* range = std::ranges::find(plausible_ranges(), name, &PlausibleRange::name);
  if (range == plausible_ranges().end() || (value >= range->low && value <= range->high)) return std::nullopt;
  return fmt::format("{} {:.6g} {} (allowed: {:.7g} to {:.7g} {}; in another unit: --column {}={})", name, value,
                     range->unit, range->low, range->high, range->unit, name, range->otherwise);
}

}  // namespace solenoid
