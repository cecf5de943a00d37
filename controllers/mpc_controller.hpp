#pragma once

#include "controllers/estimators/thesis_estimator.hpp"
#include "controllers/integral_offset.hpp"
#include "controllers/motor_laws.hpp"
#include "core/mpc/solver.hpp"
#include "core/rt/controller.hpp"

#include <memory>
#include <variant>

namespace solenoid {

using MotorLaw = std::variant<NoMotor, PdMotor, InverseDynamicsMotor>;

/// Predictive control of the valves beside a motor law: DMPC, DMPC+I and every variant whose modes come from a Solver.
///
///     each T_s    estimate, integral offset, motor force
///     each T_sp   problem from the estimate, the commands in flight and the reference ahead; solve; command the first
///     mode
///
/// When a solve ends without a usable plan, the valves keep their command; the report says so.
template <HybridModel Model>
class MpcController final : public Controller {
 public:
  struct Parts {
    Problem<Model> problem;  ///< model believed, modes, horizon, cost; state and reference are filled in each period
    std::unique_ptr<Solver<Model>> solver;
    Trajectory reference;
    IntegralSettings integral;
    MotorLaw motor;
    std::optional<double> deadline_ms;
  };

  /// Prepares the solver; may throw.
  explicit MpcController(Parts parts)
      : parts_(std::move(parts)),
        timing_(parts_.problem.modes, tick_s),
        plan_(parts_.problem),
        offset_(parts_.integral) {
    parts_.solver->prepare(parts_.problem);
  }

  Decision step(const Sensors& sensors) noexcept override {
    Decision d;
    d.reference = parts_.reference.at(sensors.time_s);
    const ActuatorState measured = estimator_.update(sensors);
    d.estimate = sensors.ideal ? sensors.truth : measured;
    d.offset_m = offset_.update(d.reference.position - d.estimate[position]);
    if (tick_++ % ticks_per_period == 0) plan_valves(sensors.time_s, d);
    d.command.coils = lines_.commanded();
    d.command.motor_force_n =
        std::visit([&](const auto& law) { return law.force(d.reference, d.estimate); }, parts_.motor);
    lines_.advance(1);
    return d;
  }

 private:
  void plan_valves(double time_s, Decision& d) noexcept {
    Problem<Model>& problem = parts_.problem;
    problem.initial = problem.model.nearest_valid(d.estimate);
    problem.lines = lines_;
    for (std::size_t j = 0; j < problem.reference.size(); ++j) {
      const ReferenceSample ahead = parts_.reference.at(time_s + static_cast<double>(j + 1) * tick_s);
      problem.reference[j] = {ahead.position + d.offset_m, ahead.velocity};
      if constexpr (HasFeedback<Model>) {
        const ReferenceSample then = parts_.reference.at(time_s + static_cast<double>(j) * tick_s);
        problem.setpoint[j] = {then.position, then.velocity};
      }
    }
    shift_plan(problem.horizon, ticks_per_period, plan_);
    d.report = parts_.solver->solve(problem, plan_, deadline());
    d.solved = true;
    if (usable(d.report.status)) lines_.command(problem.modes.pattern(plan_.modes.front()), timing_);
  }

  Deadline deadline() const {
    if (!parts_.deadline_ms) return Deadline::never();
    return Deadline::after(std::chrono::nanoseconds(static_cast<std::int64_t>(*parts_.deadline_ms * 1e6)));
  }

  Parts parts_;
  SwitchTiming timing_;
  SwitchLines lines_{0};
  Plan<Model> plan_;
  ThesisEstimator estimator_;
  IntegralOffset offset_;
  std::int64_t tick_ = 0;
};

}  // namespace solenoid
