#pragma once

#include "core/metrics/metrics.hpp"
#include "core/system/description.hpp"
#include "core/systems/inverter/inverter.hpp"

#include <span>

namespace solenoid {

/// The inverter as everything above the solvers knows it. Tick and period are 25 us.
const SystemDescription& inverter_description();

/// Evaluates a run of it with one of its mode sets; a solve that took longer than `deadline_us` is a miss. With i the true current and r the
/// desired one as complex numbers alpha + j beta:
///
/// error_percent        100 rms |i - r| / rms |r|
/// distortion_percent   100 rms |i - c r| / rms |r|,  c = sum i r* / sum |r|^2: what is left of the current beside its
///                      share of the desired one, which for a rotating r is the fundamental (total demand distortion,
///                      the demand being the desired current). That share's amplitude and phase are not in it: a current
///                      that is no answer to r at all may have little of it
/// rmse_a, largest_a    |i - r|
/// switching_hz         of one device, how often a second it turns on. A gate signal drives two, of which one turns on
///                      with each of its changes
/// switches             changes of a gate signal
Metrics evaluate_inverter_run(std::span<const TickRecord> ticks, double tick_s, const ModeSet& modes,
                              double deadline_us);

}  // namespace solenoid
