#include "controllers/compiled_relaxed.ipp"
#include "controllers/compiled_solvers.ipp"
#include "controllers/systems/actuator/models.hpp"

namespace solenoid {

// What chooses modes alone is not made for them: there is one mode.
#define SOLENOID_COMPILE_SERVO(Model)                                                                             \
  SOLENOID_COMPILE_SQP(Model)                                                                                     \
  template SolverPtr<Model> make_rounding<Model>(const ProjectedGradientSettings&, const RelaxAndRoundSettings&); \
  template RelaxedPtr<Model> make_projected_gradient<Model>(const ProjectedGradientSettings&);                    \
  template const ModelTools& model_tools<Model>();

SOLENOID_COMPILE_SERVO(ServoActuator)
SOLENOID_COMPILE_SERVO(PrestabilisedServo)

}  // namespace solenoid
