#pragma once

#include "controllers/commands_in_flight.hpp"
#include "controllers/estimators/estimator.hpp"
#include "controllers/mpc_controller.hpp"
#include "controllers/pulse_width.hpp"
#include "controllers/timing.hpp"
#include "core/mpc/relaxation.hpp"

namespace solenoid {

/// Predictive control by the relaxed problem: each T_sp its solution's first intervals go to the valves as pulses of
/// whole ticks (PulseWidth), and with a joint motor its force to the motor.
///
///     each T_s    estimate, integral offset, the tick's coils, motor force
///     each T_sp   problem from the estimate, the commands in flight and the reference ahead; solve
///
/// A solve without a usable plan leaves the shifted old plan in force; the report says so.
template <HybridModel Model>
class RelaxedController final : public Controller {
 public:
  struct Parts {
    Problem<Model> problem;
    RelaxedGrid grid;  ///< its first two intervals a control period each
    std::unique_ptr<RelaxedSolver<Model>> solver;
    Trajectory reference;
    IntegralSettings integral;
    MotorLaw motor;
    bool joint_motor = false;  ///< the motor's force is the plan's
    std::optional<double> deadline_ms;
    Estimator estimator;
    UseEstimate use_estimate;
  };

  /// Prepares the solver; may throw.
  explicit RelaxedController(Parts parts)
      : parts_(std::move(parts)),
        timing_(parts_.problem.modes, tick_s),
        in_flight_(parts_.problem.modes),
        plan_(parts_.problem, parts_.grid),
        pulses_(parts_.problem.modes, tick_s),
        offset_(parts_.integral) {
    if (parts_.grid.size() < 2 || parts_.grid.intervals[0] != ticks_per_period ||
        parts_.grid.intervals[1] != ticks_per_period)
      throw std::invalid_argument("a relaxed variant needs a horizon of at least two control periods");
    parts_.solver->prepare(parts_.problem, parts_.grid);
  }

  Decision step(const Sensors& sensors) noexcept override {
    Decision d;
    d.reference = parts_.reference.at(sensors.time_s);
    take_estimate(sensors, parts_.use_estimate, parts_.estimator, parts_.problem.model, parts_.motor, d);
    d.offset_m = offset_.update(d.reference.position - d.estimate[position]);
    const int tick = static_cast<int>(tick_ % ticks_per_period);
    if (tick == 0) plan_period(sensors.time_s, d);
    d.command.coils = pulses_.command(tick);
    d.command.motor_force_n = motor_force(d);
    pulses_.applied(tick, in_flight_.take(d.command, parts_.estimator));
    ++tick_;
    return d;
  }

 private:
  double motor_force(const Decision& d) const noexcept {
    if (parts_.joint_motor) return plan_.continuous.front()[0];
    return std::visit([&](const auto& law) { return law.force(d.reference, d.estimate); }, parts_.motor);
  }

  void plan_period(double time_s, Decision& d) noexcept {
    Problem<Model>& problem = parts_.problem;
    problem.lines = in_flight_.lines();
    problem.initial = problem.model.nearest_valid(d.estimate);
    pose_reference(parts_.reference, time_s, 0, d.offset_m, problem);
    if (tick_ > 0) shift_relaxed_plan(parts_.grid, ticks_per_period, plan_);
    d.report = parts_.solver->solve(problem, plan_, deadline_in(parts_.deadline_ms));
    d.solved = true;
    pulses_.plan(wanted(), in_flight_.lines());
  }

  /// Switch states in effect in the first two intervals of the plan, as its prediction has them.
  PulseWidth::Wanted wanted() const noexcept {
    const Problem<Model>& problem = parts_.problem;
    PulseWidth::Wanted all{};
    auto before = pattern_states<double>(problem.lines.commanded());
    for (std::size_t k = 0; k < 2; ++k) {
      const auto c = commanded_states<double>(problem.modes, plan_.row(k));
      for (int i = 0; i < ticks_per_period; ++i) {
        const auto in_flight = pattern_states<double>(problem.lines.effective(i));
        for (std::size_t s = 0; s < static_cast<std::size_t>(timing_.switches); ++s)
          all[k * ticks_per_period + static_cast<std::size_t>(i)][s] =
              effective_state(k == 0 ? in_flight[s] : before[s], c[s], i, timing_.rise[s], timing_.fall[s]);
      }
      before = c;
    }
    return all;
  }

  Parts parts_;
  SwitchTiming timing_;
  CommandsInFlight in_flight_;
  RelaxedPlan<Model> plan_;
  PulseWidth pulses_;
  IntegralOffset offset_;
  std::int64_t tick_ = 0;
};

}  // namespace solenoid
