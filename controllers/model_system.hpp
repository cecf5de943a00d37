#pragma once

#include "controllers/common_solvers.hpp"
#include "controllers/estimators/kalman_estimator.hpp"
#include "controllers/factory.hpp"
#include "controllers/ladder/kalman_guard.hpp"
#include "controllers/mpc_controller.hpp"
#include "controllers/own_settings.hpp"
#include "core/config/reader.hpp"

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

namespace solenoid {

/// A system that has one model, nothing beside its plans, and extended Kalman filters for estimators: what it says of its
/// own are its mode sets, the model and filter of a variant, and limits of its channels.
///
/// Inputs: takes over what the filter finds beyond the state (planned_inputs.hpp).
template <HybridModel M, class Inputs = PlannedInputs<M>>
class ModelSystem : public System {
 public:
  /// What the variant believes.
  virtual M model(const VariantConfig& variant) const = 0;
  /// The filter of the variant's estimator.
  virtual KalmanSetup<M> filter(const VariantConfig& variant) const = 0;
  /// Of each state, magnitudes up to which the plant counts as at rest.
  virtual StateOf<M> rest() const = 0;

  std::unique_ptr<AnyProblem> problem(const VariantConfig& v) const override {
    return std::make_unique<Problem<M>>(problem_of(v, make_horizon(v)));
  }
  const ModelTools& tools(const VariantConfig&) const override { return model_tools<M>(); }
  Estimator own_estimator(const VariantConfig& v) const override {
    return Estimator(KalmanEstimator<M>(model(v), filter(v), v.timing.tick_s));
  }
  std::unique_ptr<Controller> mpc(const VariantConfig& v, const Motion& reference,
                                  const SolverDecorator& decorate) const override {
    AnySolverPtr solver = make_solver(v);
    if (decorate) solver = decorate(std::move(solver));
    using Mpc = MpcController<M, Inputs>;
    return make_shell(v, reference,
                      Mpc({problem_of(v, make_horizon(v)), std::move(solver), v.integral, v.deadline_ms,
                           v.latency_ticks, v.timing.ticks_per_period, this->description().outputs, Inputs()}));
  }
  std::unique_ptr<Guard> guard(const VariantConfig& v) const override {
    Problem<M> problem = problem_of(v, Horizon{v.timing.tick_s, {v.horizon.steps}});
    problem.bounds = {};  // what stands in for a plan is there for states that no plan keeps within bounds
    return std::make_unique<KalmanGuard<M>>(std::move(problem), filter(v), this->description().outputs, rest());
  }

 protected:
  /// The choices get the solvers that every system has.
  ModelSystem(const SystemDescription& description, System::Choices choices)
      : System(description, with_common_solvers(std::move(choices))) {}

 private:
  static System::Choices with_common_solvers(System::Choices choices) {
    std::vector<SolverRow> all = common_solvers<M>();
    std::ranges::move(choices.solvers, std::back_inserter(all));
    choices.solvers = std::move(all);
    return choices;
  }
  Problem<M> problem_of(const VariantConfig& v, Horizon horizon) const {
    return {model(v), this->modes(v), std::move(horizon), make_cost<M>(v.cost), make_bounds<M>(v.limits)};
  }
};

/// Reads the key `model` of a system whose parameters are a struct: a table, or a file in .toml of it. Nothing there
/// leaves the defaults. read: TableReader& to Parameters, which finishes the table.
template <class Parameters, class Read>
Parameters read_model_table(TableReader& table, const Parameters& defaults, const Read& read) {
  if (!table.has("model")) return defaults;
  TableReader parameters = table.is_table("model") ? table.table("model") : table.file_table("model");
  return read(parameters);
}

}  // namespace solenoid
