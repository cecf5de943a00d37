#pragma once

#include "controllers/factory.hpp"
#include "core/rt/background_solver.hpp"
#include "experiments/rig/fault_script.hpp"

#include <algorithm>
#include <limits>

namespace solenoid {

/// Fails by script, on the time since its first solve: late, hanging, a plan of no numbers, a refusal to be prepared.
class FaultySolver final : public SolverAround {
 public:
  FaultySolver(AnySolverPtr solver, std::vector<InjectedFault> faults)
      : SolverAround(std::move(solver)), faults_(std::move(faults)) {}

 private:
  void do_prepare(const AnyProblem& problem) override {
    for (const InjectedFault& f : faults_)
      if (f.kind == "throw") throw std::runtime_error("the solver refuses to start (injected)");
    inner_->prepare(problem);
  }
  SolveReport do_solve(const AnyProblem& problem, AnyPlan& plan, Deadline deadline) noexcept override {
    if (begun_s_ < 0) begun_s_ = clock_.now_s();
    const double time_s = clock_.now_s() - begun_s_;
    SolveReport report = inner_->solve(problem, plan, deadline);
    for (const InjectedFault& f : faults_) {
      if (!f.active(time_s)) continue;
      if (f.kind == "late") clock_.sleep_until(clock_.now_s() + 1e-3 * f.value);
      while (f.kind == "hang") clock_.sleep_until(clock_.now_s() + 1.0);
      if (f.kind == "nan") {
        std::ranges::fill(plan.inputs(), std::numeric_limits<double>::quiet_NaN());
        report.cost = std::numeric_limits<double>::quiet_NaN();
      }
    }
    return report;
  }

  std::vector<InjectedFault> faults_;
  MonotonicClock clock_;
  double begun_s_ = -1.0;
};

/// Of a script, what is the solver's.
inline std::vector<InjectedFault> faults_of_solver(const std::vector<InjectedFault>& faults) {
  std::vector<InjectedFault> own;
  for (const InjectedFault& f : faults)
    if (f.target == "solver") own.push_back(f);
  return own;
}

/// Puts the controller's solver into a thread of its own, its scripted faults around it.
inline SolverDecorator in_background(const SolverThreadSettings& settings, const std::vector<InjectedFault>& faults) {
  return [settings, faults = faults_of_solver(faults)](AnySolverPtr solver) -> AnySolverPtr {
    if (!faults.empty()) solver = std::make_unique<FaultySolver>(std::move(solver), faults);
    return std::make_unique<BackgroundSolver>(std::move(solver), settings);
  };
}

}  // namespace solenoid
