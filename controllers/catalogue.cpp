#include "controllers/catalogue.hpp"

#include "controllers/compiled_solvers.hpp"
#include "controllers/systems/actuator/estimators/actuator_estimator.hpp"
#include "controllers/systems/actuator/estimators/kalman.hpp"
#include "controllers/systems/actuator/estimators/moving_horizon.hpp"
#include "controllers/systems/actuator/estimators/thesis_estimator.hpp"
#include "controllers/systems/actuator/laws/extended_cost.hpp"
#include "core/config/reader.hpp"
#include "solvers/minlp/bonmin.hpp"
#include "solvers/rounding/pulse_width.hpp"
#include "solvers/rounding/relax_and_pulse.hpp"
#include "solvers/search/branch_and_bound.hpp"
#include "solvers/search/rollout_kernels.hpp"

#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

template <HybridModel M>
SolverPtr<M> tree_search(bool prune) {
  return std::make_unique<BranchAndBound<M>>(TreeSearchSettings{.prune = prune});
}

template <HybridModel M>
SolverPtr<M> rounding(const VariantConfig& v, RoundingMethod method) {
  return make_rounding<M>({.most_iterations = v.rounding.iterations, .tolerance = 1e-4},
                          {.method = method, .improve = v.rounding.improve});
}

template <HybridModel M>
SolverPtr<M> pulses(const VariantConfig& v, std::unique_ptr<RelaxedSolver<M>> relaxed) {
  return std::make_unique<RelaxAndPulse<M>>(std::move(relaxed),
                                            RelaxAndPulseSettings{.interval = v.timing.ticks_per_period});
}

/// Every valve closed after the first block: a mode that not every configuration has.
void check_extended_cost(TableReader& table, const VariantConfig& v) {
  if (v.horizon.blocks.size() > 1 && v.valves == "three_way")
    table.fail("valves",
               "extended_cost with more than one block closes every valve after the first (allowed: two_way, "
               "three_mode, seven_mode)");
}

/// Each interval of the relaxation is as long as the longest delay, and its pulses are tried one by one.
void check_pulses(TableReader& table, const VariantConfig& v) {
  const double longest_s = std::max(v.nominal.energise_delay_s, v.nominal.deenergise_delay_s);
  if (longest_s > (PulseWidth::longest_interval + 0.5) * v.timing.tick_s)
    table.fail("solver", fmt::format("'{}' cuts pulses in intervals as long as the longest valve delay, here {:g} ms "
                                     "(allowed: delays of at most {} ms, or another solver)",
                                     v.solver, 1e3 * longest_s, PulseWidth::longest_interval));
}

std::vector<SolverRow> make_solver_rows() {
  std::vector<SolverRow> rows;
  rows.push_back({.name = "exhaustive",
                  .summary = "every sequence of modes over the blocks",
                  .groups = {"planning"},
                  .make = []<HybridModel M>(const VariantConfig&) { return tree_search<M>(false); }});
  rows.push_back({.name = "branch_and_bound",
                  .summary = "the same optimum, pruned by bounds: docs/results/search.md",
                  .groups = {"planning"},
                  .make = []<HybridModel M>(const VariantConfig&) { return tree_search<M>(true); }});
  rows.push_back(
      {.name = "extended_cost",
       .summary = "one mode tried after the other, every valve closed after the first block: docs/results/baselines.md",
       .groups = {"planning", "extended_cost"},
       .make = []<HybridModel M>(const VariantConfig& v) -> SolverPtr<M> {
         return std::make_unique<ExtendedCostSearch<M>>(v.cost.terminal_acceleration);
       },
       .check = check_extended_cost});
  rows.push_back(
      {.name = "sum_up_rounding",
       .summary = "relaxed, rounded by summing up, improved by mode swaps: docs/results/rounding.md",
       .chooses_continuous = true,
       .groups = {"planning", "rounding"},
       .make = []<HybridModel M>(const VariantConfig& v) { return rounding<M>(v, RoundingMethod::sum_up); }});
  rows.push_back({.name = "cia",
                  .summary = "the same with the rounding of least integral gap",
                  .chooses_continuous = true,
                  .groups = {"planning", "rounding"},
                  .make = []<HybridModel M>(const VariantConfig& v) {
                    return rounding<M>(v, RoundingMethod::integral_approximation);
                  }});
  rows.push_back(
      {.name = "sqp",
       .summary = "relaxed by real-time SQP, applied as pulses over each 5 ms period: docs/theory/theory-relaxed.md",
       .chooses_continuous = true,
       .plans_whole_force = true,
       .pulses = true,
       .groups = {"planning"},
       .valves = {"three_way", "two_way", "three_mode"},
       .make = []<HybridModel M>(const VariantConfig& v) { return pulses(v, make_relaxed_sqp<M>()); },
       .check = check_pulses});
  rows.push_back({.name = "ipopt",
                  .summary = "the same by Ipopt: a reference for simulations",
                  .real_time = false,
                  .instead = "sqp",
                  .chooses_continuous = true,
                  .plans_whole_force = true,
                  .pulses = true,
                  .groups = {"planning"},
                  .valves = {"three_way", "three_mode"},
                  .make = []<HybridModel M>(const VariantConfig& v) { return pulses(v, make_relaxed_ipopt<M>()); },
                  .check = check_pulses});
  rows.push_back({.name = "bonmin",
                  .summary = "the mixed-integer problem by Bonmin, where coinor-libbonmin-dev was there at build time",
                  .real_time = false,
                  .instead = "branch_and_bound, or cia for a joint motor",
                  .chooses_continuous = true,
                  .groups = {"planning"},
                  .make = []<HybridModel M>(const VariantConfig&) -> SolverPtr<M> {
                    return std::make_unique<BonminSolver<M>>();
                  }});
  return rows;
}

std::vector<EstimatorRow> make_estimator_rows() {
  // What ekf does not know is all a force, which must then be as large and as quick as a hidden payload's.
  EstimatorTuning force_alone;
  force_alone.payload_mean_kg = force_alone.payload_sigma_kg = 0.0;
  force_alone.friction_sigma = 0.0;
  force_alone.force_sigma_n = 30.0;
  force_alone.memory.force_s = 1.0;
  force_alone.pressure_drift_pa = 1e4;
  const auto kalman = [](const PneumaticActuator& model, const EstimatorTuning& tuning) {
    return actuator_estimator(ActuatorKalman(model, tuning));
  };
  return {{"thesis",
           "50 Hz Butterworth on the position, backward difference for the velocity",
           false,
           {},
           [](const PneumaticActuator&, const EstimatorTuning& tuning) {
             return actuator_estimator(ThesisEstimator(tuning.tick_s));
           }},
          {"ekf", "Kalman filter over the sensing chain; one disturbance force", true, force_alone, kalman},
          {"payload_ekf", "the same with payload, flow and friction factors", true, {}, kalman},
          {"mhe",
           "the same by moving horizon",
           true,
           {},
           [](const PneumaticActuator& model, const EstimatorTuning& tuning) {
             return actuator_estimator(MovingHorizon(model, tuning));
           }}};
}

template <class Row>
const Row& named(const std::vector<Row>& rows, std::string_view name, const char* what) {
  if (const Row* row = find_row(rows, name)) return *row;
  throw std::invalid_argument(fmt::format("no {} '{}' (allowed: {})", what, name, fmt::join(names_of(rows), ", ")));
}

}  // namespace

const std::vector<SolverRow>& solver_rows() {
  static const std::vector<SolverRow> rows = make_solver_rows();
  return rows;
}

const std::vector<EstimatorRow>& estimator_rows() {
  static const std::vector<EstimatorRow> rows = make_estimator_rows();
  return rows;
}

const SolverRow& solver_row(std::string_view name) {
  if (find_row(law_rows(), name)) throw std::invalid_argument(fmt::format("'{}' is a law, it has no solver", name));
  return named(solver_rows(), name, "solver");
}

const EstimatorRow& estimator_row(std::string_view name) { return named(estimator_rows(), name, "estimator"); }

void require_real_time(const VariantConfig& variant) {
  const SolverRow* row = find_row(solver_rows(), variant.solver);
  if (row && !row->real_time)
    throw ConfigError(
        fmt::format("variant '{}': the solver '{}' is not real time: it allocates, and keeps no deadline to "
                    "the millisecond (allowed on a plant in real time: {})",
                    variant.name, variant.solver, row->instead));
}

Estimator make_estimator(std::string_view name, const PneumaticActuator& model, const EstimatorTuning& tuning) {
  return estimator_row(name).make(model, tuning);
}

}  // namespace solenoid
