#include "controllers/common_solvers.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "controllers/systems/actuator/laws/extended_cost.hpp"
#include "controllers/systems/actuator/models.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/valves.hpp"

#include <memory>

namespace solenoid {
namespace {

/// Every valve closed after the first block: a mode that not every configuration has.
void check_extended_cost(TableReader& table, const VariantConfig& v) {
  if (v.horizon.blocks.size() > 1 && v.modes == "three_way")
    table.fail("valves",
               "extended_cost with more than one block closes every valve after the first (allowed: two_way, "
               "three_mode, seven_mode)");
}

/// For both models on valves that switch.
template <class GenericMake>
SolverMakers made(GenericMake make) {
  return SolverMakers::of<PneumaticActuator, PrestabilisedActuator>(make);
}
/// And for both on servo valves.
template <class GenericMake>
SolverMakers made_for_all(GenericMake make) {
  return SolverMakers::of<PneumaticActuator, PrestabilisedActuator, ServoActuator, PrestabilisedServo>(make);
}

}  // namespace

std::vector<SolverRow> actuator_solvers() {
  std::vector<SolverRow> rows = common_solvers<PneumaticActuator, PrestabilisedActuator, ResidualActuator>();
  rows.push_back(
      {.name = "extended_cost",
       .summary = "one mode tried after the other, every valve closed after the first block: docs/results/baselines.md",
       .groups = {"planning", "extended_cost"},
       .make = made([]<ActuatorModel M>(const VariantConfig& v) {
         return std::make_unique<ExtendedCostSearch<M>>(actuator(v).terminal_acceleration);
       }),
       .check = check_extended_cost});
  rows.push_back(
      {.name = "sqp",
       .summary = "relaxed by real-time SQP, applied as single steps by a modulator: docs/theory/theory-relaxed.md; "
                  "openings of `servo` as they are",
       .chooses_continuous = true,
       .plans_whole_input = true,
       .pulses = true,
       .groups = {"planning", "modulation", "servo", "servo_effort"},
       .modes = {"three_way", "two_way", "three_mode", servo_valves},
       .make =
           made_for_all([]<ActuatorModel M>(const VariantConfig& v) { return make_pulses(v, make_relaxed_sqp<M>()); }),
       .check = check_pulses});
  rows.push_back(
      {.name = "ipopt",
       .summary = "the same by Ipopt: a reference for simulations",
       .real_time = false,
       .instead = "sqp",
       .chooses_continuous = true,
       .plans_whole_input = true,
       .pulses = true,
       .groups = {"planning", "modulation"},
       .modes = {"three_way", "three_mode"},
       .make = made([]<ActuatorModel M>(const VariantConfig& v) { return make_pulses(v, make_relaxed_ipopt<M>()); }),
       .check = check_pulses});
  return rows;
}

}  // namespace solenoid
