#pragma once

#include "core/systems/actuator/parameters.hpp"
#include "experiments/systems/actuator/identify/record.hpp"

#include <vector>

namespace solenoid {

/// What a record says of the force that a model leaves out, at a moment in which the slide moves.
struct ResidualSample {
  double position_m = 0.0, velocity_m_s = 0.0;
  double force_n = 0.0;      ///< m_eq a + friction - cylinder - gravity - motor, of the model without payload
  double per_payload = 0.0;  ///< d force_n / d payload [N/kg]: -(L^2/r^2 a + g L/r sin(y/r))
};

/// Samples of a record, every 20 ms where it moves. Position and forces go through a Gaussian of 8 ms and, but for the
/// pressures that have been through it, the pressure channels' Bessel filter (none where its cut-off is 0), so that all
/// are late alike. A slide slower than 2 mm/s for 30 ms may be at rest, where friction is whatever holds it: nothing
/// within 40 ms of such a stretch is taken, nothing near an end stop or the record's ends.
std::vector<ResidualSample> residual_samples(const Record& record, const ActuatorParameters& believed,
                                             double pressure_filter_hz);

}  // namespace solenoid
