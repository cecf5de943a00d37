#pragma once

#include "core/mpc/mode_set.hpp"
#include "core/systems/actuator/parameters.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// Returns a valve configuration as data over coils (model.md, section 5).
///
/// `three_way`   Table 5-1: one coil a chamber, energised fills, de-energised exhausts; four modes, mode = u_p
/// `two_way`     8.3.1: a supply and an exhaust valve a chamber, normally closed; fill, exhaust or blocked: nine modes
/// `three_mode`  of those, A fills while B exhausts, the reverse, all blocked (Nguyen 2007; Qi, Bone, Zhang 2019)
/// `seven_mode`  of those, all but both filling and both exhausting (Hodgson 2015)
/// `pcm_2`       8.3.1, pulse code: two binary-weighted valves to fill and two to exhaust each chamber, openings 1/3 and 2/3:
///               a chamber is closed, or fills or exhausts by thirds: 49 modes
/// `pcm_3`       the same with three, by sevenths: 225 modes
/// `pcm_4`       the same with four, by fifteenths: 961 modes
/// `dual_orifice` a small and a large valve to fill and as many to exhaust each chamber, one of them open at a time: 25
/// `servo`       a servo valve a chamber, told by continuous inputs (servo_valve.hpp): no switch, one mode
///
/// Openings are shares of the single valve's, so that the largest flow is the same everywhere.
/// Delays come from the parameters. Throws std::invalid_argument naming what is allowed.
ModeSet valve_modes(const std::string& configuration, const ActuatorParameters& parameters);

/// The configuration whose openings are continuous inputs.
inline constexpr const char* servo_valves = "servo";
/// Opening of the small valves of `dual_orifice`.
inline constexpr double small_orifice = 0.25;

/// Returns the names above.
const std::vector<std::string>& valve_configurations();

}  // namespace solenoid
