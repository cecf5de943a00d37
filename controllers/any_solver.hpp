#pragma once

#include "core/mpc/solver.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <utility>

namespace solenoid {

struct VariantConfig;

/// A solver over a model that is known.
template <HybridModel M>
using SolverPtr = std::unique_ptr<Solver<M>>;
/// A solver over whatever model.
using AnySolverPtr = std::unique_ptr<AnySolver>;

/// Puts something around a solver before a controller gets it: a thread, a recorder, a stopwatch, injected faults.
using SolverDecorator = std::function<AnySolverPtr(AnySolverPtr)>;

/// A solver that passes everything on: what decorators change, they override.
class SolverAround : public AnySolver {
 public:
  explicit SolverAround(AnySolverPtr inner) : inner_(std::move(inner)) {}
  bool anticipates() const override { return inner_->anticipates(); }
  bool time_phases(PhaseTimes* into) noexcept override { return inner_->time_phases(into); }
  std::optional<MostWork> most_work(const AnyProblem& shape) const override { return inner_->most_work(shape); }
  bool do_most_work(bool on) noexcept override { return inner_->do_most_work(on); }

 protected:
  void do_prepare(const AnyProblem& problem) override { inner_->prepare(problem); }
  SolveReport do_solve(const AnyProblem& problem, AnyPlan& plan, Deadline deadline) noexcept override {
    return inner_->solve(problem, plan, deadline);
  }
  void do_anticipate(const AnyProblem& expected, const AnyPlan& warm_start) noexcept override {
    inner_->anticipate(expected, warm_start);
  }

  AnySolverPtr inner_;
};

}  // namespace solenoid
