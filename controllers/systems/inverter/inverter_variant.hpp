#pragma once

#include "controllers/variant.hpp"
#include "core/systems/inverter/inverter.hpp"

namespace solenoid {

/// What a variant of the inverter says beside what every variant does.
struct InverterVariant {
  InverterParameters nominal;
  double current_sigma_a = 2.0;  ///< noise of the current sensors that the filter believes
  bool operator==(const InverterVariant&) const = default;
};

/// A variant's own settings, which are the inverter's.
inline const InverterVariant& inverter(const VariantConfig& variant) { return variant.own.as<InverterVariant>(); }
/// The same, to be changed.
inline InverterVariant& inverter(VariantConfig& variant) { return variant.own.as<InverterVariant>(); }

}  // namespace solenoid
