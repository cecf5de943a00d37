#include "controllers/compiled_solvers.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "controllers/systems/actuator/laws/extended_cost.hpp"
#include "controllers/systems/actuator/models.hpp"
#include "core/config/reader.hpp"
#include "solvers/rounding/relax_and_pulse.hpp"

#include <memory>
#include <utility>

namespace solenoid {
namespace {

/// Every valve closed after the first block: a mode that not every configuration has.
void check_extended_cost(TableReader& table, const VariantConfig& v) {
  if (v.horizon.blocks.size() > 1 && v.modes == "three_way")
    table.fail("valves",
               "extended_cost with more than one block closes every valve after the first (allowed: two_way, "
               "three_mode, seven_mode)");
}

template <HybridModel M>
SolverPtr<M> pulses(const VariantConfig& v, RelaxedPtr<M> relaxed) {
  return std::make_unique<RelaxAndPulse<M>>(std::move(relaxed),
                                            RelaxAndPulseSettings{.interval = v.timing.ticks_per_period});
}

}  // namespace

std::vector<SolverRow> actuator_solvers() {
  std::vector<SolverRow> rows;
  rows.push_back(
      {.name = "extended_cost",
       .summary = "one mode tried after the other, every valve closed after the first block: docs/results/baselines.md",
       .groups = {"planning", "extended_cost"},
       .make = []<ActuatorModel M>(const VariantConfig& v) -> SolverPtr<M> {
         return std::make_unique<ExtendedCostSearch<M>>(actuator(v).terminal_acceleration);
       },
       .check = check_extended_cost});
  rows.push_back(
      {.name = "sqp",
       .summary = "relaxed by real-time SQP, applied as pulses over each 5 ms period: docs/theory/theory-relaxed.md",
       .chooses_continuous = true,
       .plans_whole_input = true,
       .pulses = true,
       .groups = {"planning"},
       .modes = {"three_way", "two_way", "three_mode"},
       .make = []<ActuatorModel M>(const VariantConfig& v) { return pulses(v, make_relaxed_sqp<M>()); },
       .check = check_pulses});
  rows.push_back({.name = "ipopt",
                  .summary = "the same by Ipopt: a reference for simulations",
                  .real_time = false,
                  .instead = "sqp",
                  .chooses_continuous = true,
                  .plans_whole_input = true,
                  .pulses = true,
                  .groups = {"planning"},
                  .modes = {"three_way", "three_mode"},
                  .make = []<ActuatorModel M>(const VariantConfig& v) { return pulses(v, make_relaxed_ipopt<M>()); },
                  .check = check_pulses});
  return rows;
}

}  // namespace solenoid
