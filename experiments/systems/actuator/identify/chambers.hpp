#pragma once

#include "core/systems/actuator/parameters.hpp"
#include "experiments/systems/actuator/identify/estimate.hpp"
#include "experiments/systems/actuator/identify/record.hpp"

#include <optional>

namespace solenoid {

/// What is unknown about chambers, valves and pressure channels.
struct ChamberParameters {
  double fill_coefficient = 1.5e-6;       ///< c_fill [kg/(s Pa^0.5)]
  double discharge_coefficient = 6.3e-9;  ///< c_dis [kg/(s Pa)]
  double choked_flow = 0.00061;           ///< [kg/s]
  double supply_pressure_pa = 251325.0;
  double energise_delay_s = 0.004, deenergise_delay_s = 0.001;
  double filter_delay_s = 0.0101;  ///< group delay of the Bessel filter behind the pressure sensors
  /// Heat transfer to the chambers' walls [W/(m2 K)]; the air then has a temperature of its own
  /// (docs/reference/twin.md). None: (4.18), all air at the supply's temperature.
  std::optional<double> heat_transfer;
};

/// How (4.26), (4.27) and the choked flow hang together.
enum class FlowContinuity {
  /// No jump where flow chokes: mdot_choked = c_fill sqrt((1 - b) P_s) = c_dis P_0 (1/b - 1). One free number, c_fill.
  continuous,
  free,  ///< c_fill, c_dis and mdot_choked each on its own, as in the thesis (model.md, E2)
};

enum class Chamber { a, b };

/// The choked flow and c_dis that meet this c_fill's law at the critical ratio: with them the flow does not jump.
struct ContinuousFlow {
  double choked_flow, discharge_coefficient;
};
ContinuousFlow continuous_flow(double fill_coefficient, double supply_pressure_pa, const ActuatorParameters& given);

/// The pressure a record measured in a chamber.
const std::vector<double>& measured(const Record& record, Chamber chamber);

/// The measured pressure of a chamber as the model has it, sample by sample: measured position and commanded coils in,
/// through valves with their delays, (4.18), and the filter.
///
///     d(P V^k)/dt = k R T mdot V^(k-1),   mdot = s_fill fill(P) + s_exhaust exhaust(P),   V from the measured position
///
/// In this form the position's noise is not differentiated; but trapped air at supply pressure is let in and never out,
/// so noise would pump it up: the position comes from quiet_position (signals.hpp). Steps of a quarter of the period,
/// the valves' mean opening over each, split where the flow law jumps, so the result is differentiable in every
/// parameter: a delay of a tenth of a sample shows. Starts from the first measured pressure.
std::vector<double> predicted_pressure(const Record& record, const std::vector<double>& quiet_position_m,
                                       Chamber chamber, const ChamberParameters& p, const ActuatorParameters& given);

/// Valve coefficients, choked flow, supply pressure, both valve delays and the filter's delay from any records in which
/// valves switch, both chambers together, by nonlinear least squares.
/// A chamber that moves while its valves rest tells the filter's delay; edges tell the sum of both.
/// `given`: cylinder, air, critical ratio, and where the search starts.
Findings estimate_chambers(const std::vector<const Record*>& records, const ActuatorParameters& given,
                           FlowContinuity continuity);

/// Both ways, and which the data want: continuity is refused if it makes the residuals larger than chance does (Wald's
/// test of its two equations on the free fit, 5 %). The estimates are the continuous ones unless it is refused.
/// Where (4.18) leaves residuals beyond 1.5 times `noise_pa` (of the filtered pressure; 0: not known), heat transfer to
/// the walls is tried, and kept if it takes a third of them away: without it a delay would stand for temperature.
Findings estimate_chambers(const std::vector<const Record*>& records, const ActuatorParameters& given, double noise_pa);

}  // namespace solenoid
