#pragma once

#include "experiments/systems/actuator/identify/estimate.hpp"
#include "experiments/systems/actuator/identify/record.hpp"
#include "experiments/systems/actuator/twin/twin_parameters.hpp"

namespace solenoid {

/// Standard deviations of the measured position and pressures at rest, from the spans labelled "rest":
/// position_noise_m, pressure_a_noise_pa, pressure_b_noise_pa, less the converter's share (step^2 / 12, the step being
/// the smallest difference between values). The interval is that of the mean square of a correlated series that need
/// not be Gaussian (spikes are not), by variance_of_mean.
Findings estimate_noise(const Record& record);

/// What the twin's sensing chain makes of its own noise: standard deviation of a pressure behind the filter, exactly.
double filtered_pressure_sigma_pa(const SensingEffects& sensing);

}  // namespace solenoid
