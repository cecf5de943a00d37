#pragma once

#include "core/systems/actuator/parameters.hpp"
#include "experiments/systems/actuator/identify/estimate.hpp"
#include "experiments/systems/actuator/identify/record.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// Everything that the records tell, whatever they come from. Records named as the shipped experiments are used for
/// what those are for; any other (a log of a run) for valves, delays and the slide's force balance alone, and only for
/// what no experiment told. `given`: geometry and air, and where searches start.
Findings identify(const std::vector<Record>& records, const ActuatorParameters& given);

/// The parameter file: keys of docs/reference/configuration.md over `base`, each with its interval; a value that the
/// actuator's model would refuse is left out with the reason.
std::string parameter_file(const Findings& found, const std::string& base, const std::string& source);

/// `given` with the estimates that are parameters in their places.
ActuatorParameters identified_parameters(const Findings& found, ActuatorParameters given);

}  // namespace solenoid
