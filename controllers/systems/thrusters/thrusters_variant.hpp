#pragma once

#include "controllers/variant.hpp"
#include "core/systems/thrusters/free_flyer.hpp"

namespace solenoid {

/// What a variant of the thrusters says beside what every variant does.
struct ThrustersVariant {
  FreeFlyerParameters nominal;
  double pose_sigma_m = 1e-3, angle_sigma_rad = 1e-3;  ///< noise of the channels that the filter believes
  double force_sigma = 0.02, turn_sigma = 0.05;        ///< accelerations from outside, stationary [m/s2, rad/s2]
  bool operator==(const ThrustersVariant&) const = default;
};

/// A variant's own settings, which are the thrusters'.
inline const ThrustersVariant& thrusters(const VariantConfig& variant) { return variant.own.as<ThrustersVariant>(); }
/// The same, to be changed.
inline ThrustersVariant& thrusters(VariantConfig& variant) { return variant.own.as<ThrustersVariant>(); }

}  // namespace solenoid
