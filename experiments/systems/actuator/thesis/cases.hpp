#pragma once

#include "experiments/systems/actuator/thesis/reproduce.hpp"
#include "experiments/systems/actuator/twin/twin_parameters.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// What stands in for the rig of chapters 5 and 7: the controller's own equations with white sensor noise (plant
/// "model"), or a truth plant behind the whole sensing chain ("twin"). The controller believes `inferred` either way.
struct StandIn {
  std::string name;  ///< the "parameters" of its cells
  std::string plant = "twin";
  TwinParameters twin = nominal_twin();
  double start_m = ActuatorParameters{}.equilibrium_position_m();  ///< where tests begin: y_eq of the thesis, 19.70 mm
  double integral_gain = 0.005;                                    ///< K_ip of DMPC+I, for each 1 ms sample
  int step_seeds = 10, motion_seeds = 5;
};
/// "inferred" and "twin", and the same with "+integral_per_period": K_ip summed once a period of 5 ms (model.md, E10).
std::vector<StandIn> stand_ins();

/// Tables 5-2 to 5-4: steps of 60 mm, cylinder alone.
std::vector<ReproducedCase> step_cases(const StandIn& rig);
/// Tables 7-1 to 7-9: cycloidal and sine, DMPC+I, cylinder alone and with the motor's PD law.
std::vector<ReproducedCase> motion_cases(const StandIn& rig);

/// The cases above of one table, each stand-in's; a law without integral has no "+integral_per_period".
std::vector<ReproducedCase> hardware_table(const std::string& table);

/// table-6-1 or table-6-2, simulated under four parameter sets; the controllers see the true state, never the payload.
std::vector<ReproducedCase> simulation_table(const std::string& table);

}  // namespace solenoid
