#include "experiments/systems/actuator/health/health_run.hpp"

#include "controllers/factory.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "experiments/base/processes.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "experiments/systems/actuator/twin/twin_plant.hpp"

#include <cmath>
#include <stdexcept>

namespace solenoid {
namespace {

/// The twin with a coil that fails, and a count of what that changed.
class FailingTwin final : public Plant {
 public:
  FailingTwin(TwinPlant& twin, const ModeSet& modes, const TwinParameters& parameters,
              const std::optional<CoilFault>& fault, double tick_s)
      : twin_(twin),
        fault_(fault),
        with_(modes, parameters.valves, 1),
        without_(modes, parameters.valves, 1),
        tick_s_(tick_s) {
    if (!fault) return;
    const auto on = modes.point(SwitchPattern{1} << fault->coil), off = modes.point(0);
    for (std::size_t i = 0; i < gain_.size(); ++i) gain_[i] = on[i] - off[i];
  }

  Measurement read(double time_s) noexcept override {
    const Measurement measured = twin_.read(time_s);
    if (failed_) count(time_s);
    if (fault_ && !failed_ && time_s > fault_->at_s - 0.5 * tick_s_) {
      twin_.fail_switch(fault_->coil, fault_->fault);
      with_.fail(fault_->coil, fault_->fault, time_s);
      failed_ = true;
    }
    time_s_ = time_s;
    return measured;
  }
  void write(const Command& command) noexcept override {
    twin_.write(command);
    with_.command(command.switches, time_s_);
    without_.command(command.switches, time_s_);
  }

  const std::optional<double>& shown_s() const { return shown_s_; }
  double changed_pa() const { return changed_pa_; }

 private:
  /// Adds the last tick's change of flow to what it would have done to the pressure.
  void count(double time_s) noexcept {
    const PneumaticActuator& model = twin_.physics().model();
    const ActuatorParameters& p = model.parameters();
    const TwinState& x = twin_.state();
    const double parted =
        with_.mean_opening(fault_->coil, time_s_, time_s) - without_.mean_opening(fault_->coil, time_s_, time_s);
    const double heat = p.heat_capacity_ratio * p.gas_constant * p.temperature_k;
    const std::array<double, 4> flow = {
        model.fill_flow<double>(x[pressure_a], x[twin_supply]), model.exhaust_flow<double>(x[pressure_a]),
        model.fill_flow<double>(x[pressure_b], x[twin_supply]), model.exhaust_flow<double>(x[pressure_b])};
    const double volume_a = p.piston_area_a() * model.column_a<double>(x[position]);
    const double volume_b = p.piston_area_b() * model.column_b<double>(x[position]);
    const double change_a = parted * (gain_[fill_a] * flow[fill_a] + gain_[exhaust_a] * flow[exhaust_a]) / volume_a;
    const double change_b = parted * (gain_[fill_b] * flow[fill_b] + gain_[exhaust_b] * flow[exhaust_b]) / volume_b;
    changed_pa_ *= std::exp(-(time_s - time_s_) / shown_within_s);
    changed_pa_ += heat * (std::abs(change_a) + std::abs(change_b)) * (time_s - time_s_);
    if (!shown_s_ && changed_pa_ >= shown_pa) shown_s_ = time_s;
  }

  TwinPlant& twin_;
  std::optional<CoilFault> fault_;
  ValveActuation with_, without_;
  std::array<double, 4> gain_{};
  std::optional<double> shown_s_;
  double tick_s_, time_s_ = 0.0, changed_pa_ = 0.0;
  bool failed_ = false;
};

/// A mean of squares.
struct MeanSquare {
  double sum = 0.0;
  std::int64_t count = 0;
  void add(double value) {
    sum += value * value;
    ++count;
  }
  double root() const { return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0; }
};

}  // namespace

HealthRun run_with_fault(const VariantConfig& chosen, const ScenarioConfig& scenario, std::uint64_t seed,
                         const std::optional<CoilFault>& fault, double ends_after_s,
                         const std::function<void(const Measurement&, const Command&, double changed_pa)>& tick) {
  const VariantConfig variant = told(chosen, scenario);
  const double tick_s = variant.timing.tick_s;
  const auto made = make_plant(chosen, scenario, seed);
  auto* twin = dynamic_cast<TwinPlant*>(made.get());
  if (!twin) throw std::invalid_argument("coils fail in the truth plant alone (plant = \"twin\")");
  const ModeSet modes = system_of(variant).modes(variant);
  FailingTwin plant(*twin, modes, twin->physics().parameters(), fault, tick_s);
  const auto controller = make_controller(variant, scenario.trajectory);
  CommandLimits limits = make_limits(variant);

  HealthRun run;
  MeanSquare before, after;
  const std::int64_t ticks = variant.timing.ticks_in(scenario.duration_s);
  for (std::int64_t k = 0; k < ticks; ++k) {
    const double now_s = static_cast<double>(k) * tick_s;
    const Measurement measured = plant.read(now_s);
    const Decision d = controller->step(measured);
    limits.restrict_to(controller->left());
    const Command left = limits.checked(d.command);
    plant.write(left);
    controller->applied(left);
    if (tick) tick(measured, left, plant.changed_pa());
    if (d.failed_switch >= 0 && !run.found) {
      run.found = FailedSwitch{static_cast<std::size_t>(d.failed_switch), {d.failed_as, 0.0}};
      run.found_s = now_s;
    }
    const double error_mm = 1e3 * (d.reference.axis[0].value - measured.truth[position]);
    if (!fault || now_s < fault->at_s) before.add(error_mm);
    if (run.found) after.add(error_mm);
    run.until_s = now_s;
    if (run.found && now_s > *run.found_s + ends_after_s) break;
    if (k % 1000 == 0) work_goes_on();
  }
  run.shown_s = plant.shown_s();
  run.before_mm = before.root();
  run.after_mm = after.root();
  return run;
}

}  // namespace solenoid
