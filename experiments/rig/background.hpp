#pragma once

#include "controllers/factory.hpp"
#include "core/rt/background_solver.hpp"
#include "experiments/rig/fault_script.hpp"

#include <limits>

namespace solenoid {

/// A solver that fails by script, on the time since its first solve: late, hanging, a plan of no numbers, a refusal to
/// be prepared.
template <HybridModel M>
class FaultySolver final : public Solver<M> {
 public:
  FaultySolver(std::unique_ptr<Solver<M>> solver, std::vector<InjectedFault> faults)
      : solver_(std::move(solver)), faults_(std::move(faults)) {}

  void prepare(const Problem<M>& problem) override {
    for (const InjectedFault& f : faults_)
      if (f.kind == "throw") throw std::runtime_error("the solver refuses to start (injected)");
    solver_->prepare(problem);
  }
  Report solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept override {
    if (begun_s_ < 0) begun_s_ = clock_.now_s();
    const double time_s = clock_.now_s() - begun_s_;
    Report report = solver_->solve(problem, plan, deadline);
    for (const InjectedFault& f : faults_) {
      if (!f.active(time_s)) continue;
      if (f.kind == "late") clock_.sleep_until(clock_.now_s() + 1e-3 * f.value);
      while (f.kind == "hang") clock_.sleep_until(clock_.now_s() + 1.0);
      if (f.kind == "nan") {
        for (ContinuousOf<M>& u : plan.continuous) u.fill(std::numeric_limits<double>::quiet_NaN());
        report.cost = std::numeric_limits<double>::quiet_NaN();
      }
    }
    return report;
  }

 private:
  std::unique_ptr<Solver<M>> solver_;
  std::vector<InjectedFault> faults_;
  MonotonicClock clock_;
  double begun_s_ = -1.0;
};

/// Puts the controller's solver into a thread of its own, its scripted faults around it.
class BackgroundWrapper final : public SolverWrapper {
 public:
  BackgroundWrapper(const SolverThreadSettings& settings, const std::vector<InjectedFault>& faults)
      : settings_(settings) {
    for (const InjectedFault& f : faults)
      if (f.target == "solver") faults_.push_back(f);
  }
  std::unique_ptr<Solver<PneumaticActuator>> wrap(std::unique_ptr<Solver<PneumaticActuator>> s) override {
    return wrapped(std::move(s));
  }
  std::unique_ptr<Solver<PrestabilisedActuator>> wrap(std::unique_ptr<Solver<PrestabilisedActuator>> s) override {
    return wrapped(std::move(s));
  }

 private:
  template <HybridModel M>
  std::unique_ptr<Solver<M>> wrapped(std::unique_ptr<Solver<M>> solver) {
    if (!faults_.empty()) solver = std::make_unique<FaultySolver<M>>(std::move(solver), faults_);
    return std::make_unique<BackgroundSolver<M>>(std::move(solver), settings_);
  }
  SolverThreadSettings settings_;
  std::vector<InjectedFault> faults_;
};

}  // namespace solenoid
