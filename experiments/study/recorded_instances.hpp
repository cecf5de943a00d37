#pragma once

#include "core/reference/trajectory.hpp"
#include "core/systems/actuator/prestabilised.hpp"
#include "core/systems/actuator/valves.hpp"
#include "solvers/search/branch_and_bound.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// A moment of a closed loop: everything that a solve is given.
template <HybridModel M>
struct RecordedInstance {
  StateOf<M> initial{};
  DelayLines lines;
  std::vector<OutputOf<M>> reference, setpoint;
  Plan<M> warm_start;

  void pose(Problem<M>& problem) const {
    problem.initial = initial;
    problem.lines = lines;
    problem.reference = reference;
    problem.setpoint = setpoint;
  }
};

/// Runs `problem`'s controller with its own model as the plant along `motion`, a solve each 5 ms, and keeps every
/// instance. `kick` > 0 pushes the slide every half second, so that saturated and off-track states are among them.
template <HybridModel M>
std::vector<RecordedInstance<M>> record_closed_loop(Problem<M> problem, const Trajectory& motion, Solver<M>& solver,
                                                    double kick = 0.0) {
  const SwitchTiming timing(problem.modes, 0.001);
  std::vector<RecordedInstance<M>> all;
  Plan<M> plan(problem);
  solver.prepare(problem);
  problem.initial = {motion.start(), 0.0, 101325.0, 101325.0};
  problem.lines = DelayLines(0);
  for (int k = 0; 0.001 * k < motion.duration_s(); ++k) {
    const MotionSample now = motion.at(0.001 * k);
    if (k % 500 == 250) problem.initial[velocity] += (k % 1000 == 250 ? kick : -kick);
    if (k % 5 == 0) {
      for (std::size_t j = 0; j < problem.reference.size(); ++j) {
        const auto at = [&](std::size_t ahead) {
          const MotionSample r = motion.at(0.001 * (k + static_cast<double>(ahead)));
          return OutputOf<M>{r.value, r.rate};
        };
        problem.reference[j] = at(j + 1);
        if (!problem.setpoint.empty()) problem.setpoint[j] = at(j);
      }
      shift_plan(problem.horizon, 5, plan);
      all.push_back({problem.initial, problem.lines, problem.reference, problem.setpoint, plan});
      solver.solve(problem, plan, Deadline::never());
      problem.lines.command(problem.modes.pattern(plan.modes.front()), timing);
    }
    SwitchedOf<M> opening;
    std::ranges::copy(problem.modes.point(problem.lines.effective()), opening.begin());
    ContinuousOf<M> motor{};
    if constexpr (HasFeedback<M>)
      motor = problem.model.template feedback<double>(problem.initial, {now.value, now.rate});
    problem.initial = problem.model.template step<double>(problem.initial, opening, motor, 0.001);
    problem.lines.advance(1);
  }
  return all;
}

/// The actuator's problem with these valves and blocks (in 5 ms periods).
template <class M>
Problem<M> actuator_problem(const std::string& valves, const std::vector<int>& periods, double switching = 0.0) {
  const ActuatorParameters p;
  Horizon horizon{0.001, {}};
  for (const int n : periods) horizon.blocks.push_back(5 * n);
  Cost<M> cost;
  cost.tracking = {1.0, 0.0};
  cost.switching = switching;
  return Problem<M>(M(p), valve_modes(valves, p), horizon, cost);
}

}  // namespace solenoid
