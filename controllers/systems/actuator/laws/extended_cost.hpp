#pragma once

#include "controllers/systems/actuator/laws/law.hpp"
#include "core/mpc/rollout.hpp"
#include "core/mpc/solver.hpp"

#include <cmath>
#include <stdexcept>

namespace solenoid {

/// Discrete-valued predictive control with an extended cost: one mode is chosen, by trying each.
///
///     minimise over the mode of the first block, every valve being closed in the blocks after it (if any):
///     J = sum_j w_y e[j]^2 + w_v e'[j]^2 + switching * (coil changes) + air
///         + terminal terms in e[N], e'[N]                                                            [problem.hpp]
///         + w_a e''[N]^2,    e'' = a_d - a, a the acceleration that the pressures at the end of the horizon give
///
/// The last term is the one that problem.hpp does not have: it asks for pressures that leave the slide at peace when
/// the horizon ends. With w_a = 0 and one block this is Exhaustive.
///
/// promise  the least J unless the deadline comes first; ties go to fewer switches; no allocation, lock or exception
///
/// Y. Qi, G. M. Bone, Y. Zhang, "Position control of pneumatic actuators using three-mode discrete-valued model
/// predictive control", Actuators 8(3), 56, 2019 (DVMPC2): three modes, direct switching, a cost with more terms than
/// the position error of DVMPC1. The terms here are our reading of it (docs/results/baselines.md).
template <HybridModel M>
class ExtendedCostSearch final : public Solver<M> {
 public:
  explicit ExtendedCostSearch(double terminal_acceleration_weight) : weight_(terminal_acceleration_weight) {}

  void prepare(const Problem<M>& problem) override {
    timing_ = SwitchTiming(problem.modes, problem.horizon.dt_s);
    closed_ = closed_mode(problem.modes);
    if (problem.horizon.blocks.size() > 1 && closed_ < 0)
      throw std::invalid_argument("extended_cost with more than one block needs a mode with every valve closed");
  }

  SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept override {
    const auto start = Deadline::Clock::now();
    SolveReport best;
    best.status = Status::optimal;
    int chosen = -1;
    bool any_feasible = false;
    for (int mode = 0; mode < problem.modes.size(); ++mode) {
      if (deadline.passed()) {
        best.status = Status::deadline_reached;
        break;
      }
      const Rollout<M> r = rolled(problem, plan, mode);
      const double cost = cost_of(problem, r);
      ++best.nodes;
      any_feasible = any_feasible || r.feasible;
      const bool better = cost < best.cost || (cost == best.cost && r.switches < best.switches);
      if (!better || !std::isfinite(cost)) continue;
      best.cost = cost, best.switches = r.switches, chosen = mode;
    }
    if (chosen < 0 && best.status == Status::optimal)
      best.status = any_feasible ? Status::numerical_failure : Status::infeasible;
    conclude(problem, chosen, plan, best);
    best.time_us =
        1e-3 * static_cast<double>(
                   std::chrono::duration_cast<std::chrono::nanoseconds>(Deadline::Clock::now() - start).count());
    return best;
  }

  /// J of one mode; infinite where bounds or dwell forbid it.
  double cost_of_mode(const Problem<M>& problem, const Plan<M>& plan, int mode) const noexcept {
    return cost_of(problem, rolled(problem, plan, mode));
  }

 private:
  static int closed_mode(const ModeSet& modes) {
    for (int mode = 0; mode < modes.size(); ++mode) {
      const auto opening = modes.point(modes.pattern(mode));
      if (std::ranges::all_of(opening, [](double s) { return s == 0.0; })) return mode;
    }
    return -1;
  }

  Rollout<M> rolled(const Problem<M>& problem, const Plan<M>& plan, int mode) const noexcept {
    Rollout<M> r(problem);
    for (std::size_t b = 0; b < problem.horizon.blocks.size(); ++b)
      roll_block(problem, timing_, b == 0 ? mode : closed_, problem.horizon.blocks[b], plan.continuous[b], r);
    return r;
  }

  double cost_of(const Problem<M>& problem, const Rollout<M>& r) const noexcept {
    const double cost = total_cost(problem, r);
    if (weight_ == 0.0 || problem.reference.size() < 2) return cost;
    const std::size_t last = problem.reference.size() - 1;
    const double desired =
        (problem.reference[last][velocity] - problem.reference[last - 1][velocity]) / problem.horizon.dt_s;
    ContinuousOf<M> motor{};
    if constexpr (HasFeedback<M>) motor = problem.model.template feedback<double>(r.state, problem.setpoint[last]);
    const double error = desired - believed_acceleration(problem.model, r.state, motor[0]);
    return cost + weight_ * error * error;
  }

  void conclude(const Problem<M>& problem, int chosen, Plan<M>& plan, SolveReport& report) const noexcept {
    const int hold = std::max(0, problem.modes.find(problem.lines.commanded()));
    for (std::size_t b = 0; b < plan.modes.size(); ++b) plan.modes[b] = chosen < 0 ? hold : b == 0 ? chosen : closed_;
    if (report.status == Status::deadline_reached)
      report.bound = 0.0;
    else if (chosen >= 0)
      report.bound = report.cost;
  }

  double weight_;
  int closed_ = -1;
  SwitchTiming timing_;
};

}  // namespace solenoid
