#pragma once

#include "core/rt/deferred_solver.hpp"
#include "experiments/rig/fault_script.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

namespace solenoid {

/// A solver in a thread, on simulated time: its plan is there `ticks` after it began, and it begins when it is free.
class LateSolver final : public DeferredSolver {
 public:
  LateSolver(AnySolverPtr solver, const std::vector<InjectedFault>& faults, double tick_s)
      : solver_(std::move(solver)), faults_(faults), tick_s_(tick_s) {}

  void post(std::int64_t ticket, const AnyProblem& problem, const AnyPlan& warm_start, double) noexcept override {
    waiting_->copy_conditions(problem);
    waiting_start_->assign(warm_start);
    waiting_ticket_ = ticket;
    begin_if_free();
  }
  const Finished* collect() noexcept override {
    ++tick_;
    if (!busy_ || tick_ < done_at_) return nullptr;
    busy_ = false;
    std::swap(given_, working_);
    begin_if_free();
    return &given_;
  }
  bool anticipates() const override { return solver_->anticipates(); }

 private:
  void do_prepare(const AnyProblem& problem) override {
    for (const InjectedFault& f : faults_)
      if (f.kind == "throw") throw std::runtime_error("the solver refuses to start (injected)");
    solver_->prepare(problem);
    waiting_ = Held(problem);
    waiting_start_ = working_.plan = given_.plan = Held(problem.new_plan());
  }
  SolveReport do_solve(const AnyProblem& problem, AnyPlan& plan, Deadline deadline) noexcept override {
    return solver_->solve(problem, plan, deadline);
  }
  void do_anticipate(const AnyProblem& expected, const AnyPlan& warm_start) noexcept override {
    if (!busy_) solver_->anticipate(expected, warm_start);
  }
  void begin_if_free() noexcept {
    if (busy_ || waiting_ticket_ < 0) return;
    working_.ticket = waiting_ticket_;
    waiting_ticket_ = -1;
    working_.plan->assign(*waiting_start_);
    working_.report = solver_->solve(*waiting_, *working_.plan, Deadline::never());
    done_at_ = tick_ + 1;
    busy_ = true;
    const double now_s = static_cast<double>(tick_) * tick_s_;
    for (const InjectedFault& f : faults_) {
      if (!f.active(now_s)) continue;
      if (f.kind == "late") done_at_ = tick_ + 1 + std::llround(f.value);
      if (f.kind == "hang") done_at_ = std::numeric_limits<std::int64_t>::max();
      if (f.kind == "nan") std::ranges::fill(working_.plan->inputs(), std::numeric_limits<double>::quiet_NaN());
    }
  }

  AnySolverPtr solver_;
  std::vector<InjectedFault> faults_;
  double tick_s_;
  Held<AnyProblem> waiting_;
  Held<AnyPlan> waiting_start_;
  std::int64_t waiting_ticket_ = -1, tick_ = 0, done_at_ = 0;
  bool busy_ = false;
  Finished working_, given_;
};

}  // namespace solenoid
