#pragma once

#include "controllers/any_solver.hpp"
#include "controllers/instances/instance_set.hpp"

#include <memory>
#include <vector>

namespace solenoid {

/// A solve as it was posed.
template <HybridModel Model>
struct PosedInstance {
  std::int64_t solve = 0;  ///< which of the solver's solves, from 0
  StateOf<Model> initial{};
  DelayLines lines;
  std::vector<OutputOf<Model>> reference, setpoint;
  std::vector<double> load;  ///< of the model, if it has one
  Plan<Model> warm_start;
};

/// Keeps copies of what a solver is asked: every `every`th solve, at most `capacity` of them, in storage sized by
/// prepare.
template <HybridModel Model>
class RecordingSolver final : public SolverAround<Model> {
 public:
  RecordingSolver(std::unique_ptr<Solver<Model>> inner, std::vector<PosedInstance<Model>>& into, std::size_t capacity,
                  std::int64_t every = 1)
      : SolverAround<Model>(std::move(inner)), into_(into), capacity_(capacity), every_(every) {}

  void prepare(const Problem<Model>& problem) override {
    this->inner_->prepare(problem);
    PosedInstance<Model> empty;
    empty.reference = problem.reference;
    empty.setpoint = problem.setpoint;
    empty.warm_start = Plan<Model>(problem);
    if constexpr (HasLoad<Model>) empty.load.resize(Model::load_size);
    into_.assign(capacity_, empty);
    used_ = 0;
    solves_ = 0;
  }

  SolveReport solve(const Problem<Model>& problem, Plan<Model>& plan, Deadline deadline) noexcept override {
    if (solves_ % every_ == 0 && used_ < into_.size()) {
      PosedInstance<Model>& copy = into_[used_++];
      copy.solve = solves_;
      copy.initial = problem.initial;
      copy.lines = problem.lines;
      copy.reference = problem.reference;
      copy.setpoint = problem.setpoint;
      copy.warm_start = plan;
      if constexpr (HasLoad<Model>) std::ranges::copy(problem.model.load(), copy.load.begin());
    }
    ++solves_;
    return this->inner_->solve(problem, plan, deadline);
  }

  /// Instances kept since prepare: the first of the storage.
  std::size_t kept() const { return used_; }

 private:
  std::vector<PosedInstance<Model>>& into_;
  std::size_t capacity_, used_ = 0;
  std::int64_t every_, solves_ = 0;
};

}  // namespace solenoid
