#pragma once

#include "core/mpc/deadline.hpp"
#include "core/mpc/phases.hpp"
#include "core/mpc/plan.hpp"
#include "core/mpc/rollout.hpp"

#include <optional>

namespace solenoid {

/// Solves problems of whatever model, one after another of the same shape: what stands around solvers, and the solvers
/// that need not know the model, derive from this; those that predict from Solver below.
class AnySolver {
 public:
  virtual ~AnySolver() = default;

  /// Sizes everything for problems with this model, mode set and horizon. May allocate and throw.
  void prepare(const AnyProblem& problem) { do_prepare(problem); }
  /// Improves on `plan`, which comes in as the warm start and leaves as the best plan found, by the deadline.
  /// No allocation, lock or exception.
  SolveReport solve(const AnyProblem& problem, AnyPlan& plan, Deadline deadline) noexcept {
    return do_solve(problem, plan, deadline);
  }
  /// Whether anticipate() shortens the next solve.
  virtual bool anticipates() const { return false; }
  /// Prepares for a problem that is still to be measured: `expected` as it is forecast, and its warm start. The next
  /// solve of a problem that differs from it in the measured state alone may use what was prepared, and then says so
  /// (SolveReport::anticipated); its plan may differ from what solve() alone finds. No allocation, lock or exception.
  void anticipate(const AnyProblem& expected, const AnyPlan& warm_start) noexcept {
    do_anticipate(expected, warm_start);
  }
  /// From now on every solve adds its parts to `into`; null switches that off, which leaves one test of a pointer a
  /// phase. Returns whether the solver can tell.
  virtual bool time_phases(PhaseTimes* /*into*/) noexcept { return false; }
  /// The most work that a solve of a problem of this shape (mode set, grid) takes, whatever its state, reference,
  /// set-points, commands in flight, model's numbers, weights and warm start are: a proof by counting. Nothing if the
  /// solver knows of none. May allocate.
  virtual std::optional<MostWork> most_work(const AnyProblem& /*shape*/) const { return std::nullopt; }
  /// From now on every solve does as much of that work as there can be for its problem, so that it can be timed: it
  /// leaves out nothing that could be proven to be of no use. Plans and reports stay the same. Returns whether the solver
  /// can; one without most_work() cannot.
  virtual bool do_most_work(bool /*on*/) noexcept { return false; }

 private:
  virtual void do_prepare(const AnyProblem& problem) = 0;
  virtual SolveReport do_solve(const AnyProblem& problem, AnyPlan& plan, Deadline deadline) noexcept = 0;
  virtual void do_anticipate(const AnyProblem& /*expected*/, const AnyPlan& /*warm_start*/) noexcept {}
};

/// Solves problems over a model. What its functions promise stands with AnySolver.
template <HybridModel M>
class Solver : public AnySolver {
 public:
  /// See AnySolver.
  virtual void prepare(const Problem<M>& problem) = 0;
  /// See AnySolver.
  virtual SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept = 0;
  /// See AnySolver.
  virtual void anticipate(const Problem<M>& /*expected*/, const Plan<M>& /*warm_start*/) noexcept {}

 private:
  /// Throws std::bad_cast for a problem over another model.
  void do_prepare(const AnyProblem& problem) final { prepare(dynamic_cast<const Problem<M>&>(problem)); }
  SolveReport do_solve(const AnyProblem& problem, AnyPlan& plan, Deadline deadline) noexcept final {
    const auto& own = static_cast<const Problem<M>&>(problem);
    SolveReport report = solve(own, static_cast<Plan<M>&>(plan), deadline);
    if (report.status == Status::infeasible) report.broken = first_broken_limit(own, static_cast<const Plan<M>&>(plan));
    return report;
  }
  void do_anticipate(const AnyProblem& expected, const AnyPlan& warm_start) noexcept final {
    anticipate(static_cast<const Problem<M>&>(expected), static_cast<const Plan<M>&>(warm_start));
  }
};

}  // namespace solenoid
