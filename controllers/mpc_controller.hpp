#pragma once

#include "controllers/estimators/estimator.hpp"
#include "controllers/estimators/forecast.hpp"
#include "controllers/integral_offset.hpp"
#include "controllers/motor_laws.hpp"
#include "controllers/variant.hpp"
#include "core/mpc/solver.hpp"
#include "core/rt/controller.hpp"

#include <algorithm>
#include <memory>
#include <variant>

namespace solenoid {

using MotorLaw = std::variant<NoMotor, PdMotor, InverseDynamicsMotor>;

/// Predictive control of the valves beside a motor law: DMPC, DMPC+I and every variant whose modes come from a Solver.
///
///     each T_s    estimate, integral offset, motor force
///     each T_sp   problem from the estimate, the commands in flight and the reference ahead; solve; command the first
///     mode, latency_ticks later: the problem starts from the state forecast to that moment
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
    Estimator estimator;
    UseEstimate use_estimate;
    int latency_ticks = 0;  ///< from sampling to the plan's taking effect, at most a period
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
    estimate(sensors, d);
    d.offset_m = offset_.update(d.reference.position - d.estimate[position]);
    release_plan();
    if (tick_ % ticks_per_period == 0) plan_valves(sensors.time_s, d);
    release_plan();
    d.command.coils = lines_.commanded();
    d.command.motor_force_n = motor_force(d.reference, d.estimate);
    SwitchedOf<Model> opening{};
    std::ranges::copy(parts_.problem.modes.point(lines_.effective()), opening.begin());
    parts_.estimator.applied(opening, d.command.motor_force_n);
    lines_.advance(1);
    ++tick_;
    return d;
  }

 private:
  /// Under ideal sensing the true state passes the estimator by.
  void estimate(const Sensors& sensors, Decision& d) noexcept {
    if (sensors.ideal) {
      d.estimate = sensors.truth;
      return;
    }
    d.estimate = parts_.estimator.update(sensors);
    d.detail = parts_.estimator.detail();
    const UseEstimate& use = parts_.use_estimate;
    if (!use.payload && !use.disturbance) return;
    Model& model = parts_.problem.model;
    model.set_load(use.payload ? d.detail.payload_kg : model.parameters().payload_mass_kg,
                   use.disturbance ? d.detail.disturbance_n : 0.0);
  }

  double motor_force(const ReferenceSample& desired, const StateOf<Model>& x) const noexcept {
    if constexpr (HasFeedback<Model>)
      if (planned_n_ != 0.0) {  // a joint plan's share on top of the law, saturated together
        const Model& model = parts_.problem.model;
        const auto law = model.template feedback<double>(x, {desired.position, desired.velocity});
        return model.template saturated_motor_force<double>(law[0] + planned_n_);
      }
    return std::visit([&](const auto& law) { return law.force(desired, x); }, parts_.motor);
  }

  void release_plan() noexcept {
    if (due_tick_ != tick_) return;
    lines_.command(due_pattern_, timing_);
    planned_n_ = due_planned_n_;
    due_tick_ = -1;
  }

  void plan_valves(double time_s, Decision& d) noexcept {
    Problem<Model>& problem = parts_.problem;
    problem.lines = lines_;
    const int latency = parts_.latency_ticks;
    problem.initial = problem.model.nearest_valid(forecast(
        problem.model, problem.modes, d.estimate, problem.lines, latency, tick_s, [&](int j, const StateOf<Model>& x) {
          return ContinuousOf<Model>{motor_force(parts_.reference.at(time_s + j * tick_s), x)};
        }));
    for (std::size_t j = 0; j < problem.reference.size(); ++j) {
      const ReferenceSample ahead = parts_.reference.at(time_s + (latency + static_cast<double>(j + 1)) * tick_s);
      problem.reference[j] = {ahead.position + d.offset_m, ahead.velocity};
      if constexpr (HasFeedback<Model>) {
        const ReferenceSample then = parts_.reference.at(time_s + static_cast<double>(j) * tick_s);
        problem.setpoint[j] = {then.position, then.velocity};
      }
    }
    shift_plan(problem.horizon, ticks_per_period, plan_);
    d.report = parts_.solver->solve(problem, plan_, deadline());
    d.solved = true;
    if (!usable(d.report.status)) return;
    due_pattern_ = problem.modes.pattern(plan_.modes.front());
    due_planned_n_ = plan_.continuous.front()[0];
    due_tick_ = tick_ + latency;
  }

  Deadline deadline() const {
    if (!parts_.deadline_ms) return Deadline::never();
    return Deadline::after(std::chrono::nanoseconds(static_cast<std::int64_t>(*parts_.deadline_ms * 1e6)));
  }

  Parts parts_;
  SwitchTiming timing_;
  SwitchLines lines_{0};
  Plan<Model> plan_;
  IntegralOffset offset_;
  std::int64_t tick_ = 0, due_tick_ = -1;
  SwitchPattern due_pattern_ = 0;
  double planned_n_ = 0.0, due_planned_n_ = 0.0;  // a joint plan's motor force beside the law
};

}  // namespace solenoid
