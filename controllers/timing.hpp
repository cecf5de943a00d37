#pragma once

namespace solenoid {

/// Sampling of the thesis (chapter 5): estimators, motor law and model step run at T_s, the valves' search at T_sp.
inline constexpr double tick_s = 0.001;
/// Ticks T_s in a control period T_sp.
inline constexpr int ticks_per_period = 5;
/// The control period T_sp.
inline constexpr double period_s = tick_s * ticks_per_period;

}  // namespace solenoid
