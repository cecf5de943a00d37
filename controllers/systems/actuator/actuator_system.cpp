#include "controllers/factory.hpp"
#include "controllers/mpc_controller.hpp"
#include "controllers/solver_bank.hpp"
#include "controllers/systems/actuator/actuator_guard.hpp"
#include "controllers/systems/actuator/actuator_keys.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "controllers/systems/actuator/estimators/servo_estimator.hpp"
#include "controllers/systems/actuator/estimators/valve_health.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"

#include <algorithm>
#include <array>
#include <concepts>
#include <optional>
#include <stdexcept>
#include <type_traits>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

System::Choices choices() {
  System::Choices c;
  c.mode_sets = valve_configurations();
  for (const EstimatorRow& row : estimator_rows()) c.estimators.push_back({row.name, row.summary});
  c.solvers = actuator_solvers();
  c.laws = actuator_laws();
  c.parameter_sets = parameter_set_names();
  return c;
}

void read_model(TableReader& table, ActuatorVariant& v) {
  if (table.is_table("model")) {
    v.model = "table";
    TableReader parameters = table.table("model");
    v.nominal = read_parameters(parameters);
    return;
  }
  v.model = table.text_or("model", v.model);
  if (v.model.ends_with(".toml")) {
    TableReader parameters = table.file_table("model");
    v.nominal = read_parameters(parameters);
    return;
  }
  try {
    v.nominal = named_parameters(v.model);
  } catch (const std::invalid_argument& error) {
    table.fail("model", fmt::format("{}, or a file of parameters ending in .toml", error.what()));
  }
}

/// A table, or a file of one; none is no residual.
void read_residual(TableReader& table, ActuatorVariant& v) {
  if (!table.has("residual")) return;
  const bool is_file = !table.is_table("residual");
  if (is_file && !table.text("residual").ends_with(".toml"))
    table.fail("residual", fmt::format("'{}' (allowed: a file in .toml, or a table)", table.text("residual")));
  TableReader residual = is_file ? table.file_table("residual") : table.table("residual");
  v.residual = read_force_residual(residual);
  if (v.residual.empty())
    table.fail("residual",
               "neither velocity nor position explains anything (allowed: a residual of one or both, or no key)");
}

void read_use_of_estimate(TableReader& table, const EstimatorRow& row, ActuatorVariant& v) {
  const std::string use =
      table.text_or("use_estimate", "state", {"state", "payload", "disturbance", "payload_and_disturbance"});
  v.use_estimate = {use.starts_with("payload"), use.ends_with("disturbance")};
  if (use != "state" && !row.finds_load)
    table.fail("use_estimate", fmt::format("the estimator '{}' has nothing but the state (allowed: state)", row.name));
}

void check_estimation(TableReader& table, const EstimatorTuning& t) {
  const auto above = [&](const char* high, double high_value, const char* low, double low_value) {
    if (!(low_value < high_value))
      table.table("estimation").fail(high, fmt::format("not above {} (allowed: above {:g})", low, low_value));
  };
  above("position_high_m", t.position_high_m, "position_low_m", t.position_low_m);
  above("pressure_high_pa", t.pressure_high_pa, "pressure_low_pa", t.pressure_low_pa);
}

void check_joint(const TableReader& table, const VariantConfig& v) {
  const SolverRow* row = find_row(system_of(v).solvers(), v.solver);
  if (actuator(v).motor != "joint" || !row || row->chooses_continuous) return;
  std::vector<std::string> able;
  for (const SolverRow& other : system_of(v).solvers())
    if (other.chooses_continuous) able.push_back(other.name);
  table.fail("motor",
             fmt::format("'joint' needs a solver that chooses continuous inputs, not '{}' (allowed solvers: {})",
                         v.solver, fmt::join(able, ", ")));
}

/// Openings that are continuous inputs are for a solver or law that knows no switch.
void check_servo(const TableReader& table, const VariantConfig& v) {
  if (!on_servo_valves(v)) return;
  std::vector<std::string> able;
  const auto collect = [&](const auto& rows) {
    for (const auto& row : rows)
      if (std::ranges::count(row.modes, v.modes) > 0) able.push_back(row.name);
  };
  collect(system_of(v).solvers());
  collect(system_of(v).laws());
  if (std::ranges::count(able, v.solver) == 0)
    table.fail("solver", fmt::format("'{}' chooses valve states, and '{}' has none to choose from: its openings are "
                                     "continuous (allowed solvers: {})",
                                     v.solver, v.modes, fmt::join(able, ", ")));
}

/// The servo valves as the variant believes them.
ServoPair servo_pair(const VariantConfig& v) { return {actuator(v).nominal.servo, v.timing.tick_s}; }

/// What finds a coil that fails needs a controller that can do without it.
void check_health(const TableReader& table, const VariantConfig& v) {
  if (!actuator(v).valve_health) return;
  if (const std::string why = why_no_valve_health(v); !why.empty()) table.fail("valve_health", why);
}

/// A residual is for what predicts with it.
void check_residual(const TableReader& table, const VariantConfig& v) {
  if (!has_residual(v)) return;
  const SolverRow* row = find_row(system_of(v).solvers(), v.solver);
  if (on_servo_valves(v) || !row || !row->make.makes(typeid(ResidualActuator)))
    table.fail("residual",
               fmt::format("'{}' on '{}' does not predict with one (allowed: with branch_and_bound and the others "
                           "that choose modes of valves that switch)",
                           v.solver, v.modes));
  if (actuator(v).motor == "inverse_dynamics")
    table.fail("residual",
               "the motor's law 'inverse_dynamics' knows nothing of it (allowed motors: none, pd, "
               "in_prediction, joint)");
}

template <HybridModel Model>
Problem<Model> actuator_problem_of(const VariantConfig& v) {
  const Model model = make_model<Model>(v);
  // What a plan adds to the motor's law is the solver's to choose in joint plans, and nothing in others. It may turn
  // the law's whole force round.
  const double most =
      actuator(v).motor == "joint" ? (HasFeedback<Model> ? 2.0 : 1.0) * model.parameters().motor_force_limit_n() : 0.0;
  Bounds<Model> bounds = make_bounds<Model>(v.limits);
  Cost<Model> cost = make_cost<Model>(v.cost);
  bounds.continuous_lower[motor_input] = -most;
  bounds.continuous_upper[motor_input] = most;
  if constexpr (std::derived_from<Model, ServoActuator>)
    for (const std::size_t opening : {opening_a_input, opening_b_input}) {
      bounds.continuous_lower[opening] = -1.0;
      bounds.continuous_upper[opening] = 1.0;
      cost.continuous[opening] = actuator(v).servo.effort;
    }
  return {model, system_of(v).modes(v), make_horizon(v), cost, bounds};
}

template <class Inputs>
Inputs make_inputs(const VariantConfig& v) {
  MotorInputs motor = make_motor(v, make_model<PneumaticActuator>(v));
  if constexpr (std::same_as<Inputs, ServoInputs>)
    return ServoInputs(motor, actuator(v).servo, actuator(v).motor == "joint");
  else
    return motor;
}

/// Chambers: what supply and exhaust do undoes what the other does.
constexpr std::array<std::array<std::size_t, 2>, 2> chambers = {{{fill_a, exhaust_a}, {fill_b, exhaust_b}}};

HealthTuning health_tuning(const VariantConfig& v) {
  HealthTuning tuning;
  tuning.tick_s = v.timing.tick_s;
  const EstimatorTuning& sensors = actuator(v).estimation;
  if (sensors.pressure_filter_hz > 0.0) tuning.filter_hz = sensors.pressure_filter_hz;
  tuning.pressure_low_pa = sensors.pressure_low_pa;
  tuning.pressure_high_pa = sensors.pressure_high_pa;
  return tuning;
}

/// A solver for the variant's valves, and one for each set of what is left of them.
AnySolverPtr solvers_of(const VariantConfig& v, const std::vector<SpareModes>& spares) {
  AnySolverPtr first = make_solver(v);
  if (spares.empty()) return first;
  std::vector<SolverBank::Spare> others;
  others.reserve(spares.size());
  for (const SpareModes& spare : spares) others.emplace_back(spare.left, spare.left ? make_solver(v) : nullptr);
  return std::make_unique<SolverBank>(std::move(first), std::move(others));
}

template <HybridModel Model>
std::unique_ptr<Controller> actuator_mpc(const VariantConfig& v, const Motion& reference,
                                         const SolverDecorator& decorate) {
  const std::vector<SpareModes> spares = system_of(v).spare_modes(v);
  AnySolverPtr solver = solvers_of(v, spares);
  if (decorate) solver = decorate(std::move(solver));
  using Inputs = std::conditional_t<std::derived_from<Model, ServoActuator>, ServoInputs, MotorInputs>;
  using Mpc = MpcController<Model, Inputs>;
  return make_shell(v, reference,
                    Mpc({actuator_problem_of<Model>(v), std::move(solver), v.integral, v.deadline_ms, v.latency_ticks,
                         v.timing.ticks_per_period, actuator_description().outputs, make_inputs<Inputs>(v), spares}));
}

/// Calls back with the type of the variant's model, as a null pointer to it.
template <class Use>
auto with_model(const VariantConfig& v, const Use& use) {
  if (on_servo_valves(v))
    return predicts_motor(v) ? use(static_cast<PrestabilisedServo*>(nullptr))
                             : use(static_cast<ServoActuator*>(nullptr));
  if (has_residual(v)) return use(static_cast<ResidualActuator*>(nullptr));
  return predicts_motor(v) ? use(static_cast<PrestabilisedActuator*>(nullptr))
                           : use(static_cast<PneumaticActuator*>(nullptr));
}

/// The hybrid pneumatic-electric actuator.
class ActuatorSystem final : public System {
 public:
  ActuatorSystem() : System(actuator_description(), choices()) { add_keys(actuator_keys()); }

  const SystemDescription& description_for(const VariantConfig& v) const override {
    return on_servo_valves(v) ? servo_description() : actuator_description();
  }
  std::vector<const SystemDescription*> descriptions() const override {
    return {&actuator_description(), &servo_description()};
  }

  /// The thesis's DMPC without integral action, the cylinder alone.
  VariantConfig defaults() const override {
    VariantConfig v;
    v.modes = "three_way";
    v.estimator = "thesis";
    v.cost.tracking[0] = 1.0;
    return v;
  }
  void read(TableReader& table, VariantConfig& v) const override {
    const EstimatorRow& row = estimator_row(v.estimator);
    actuator(v).estimation = row.tuning;
    read_model(table, actuator(v));
    read_residual(table, actuator(v));
    read_use_of_estimate(table, row, actuator(v));
  }
  void check(TableReader& table, const VariantConfig& v) const override {
    check_estimation(table, actuator(v).estimation);
    check_servo(table, v);
    check_joint(table, v);
    check_health(table, v);
    check_residual(table, v);
  }
  /// The plane in which the arm moves; none leaves the parameters' own.
  void tell(VariantConfig& v, const std::string& setting) const override {
    if (!setting.empty()) actuator(v).nominal.plane = setting == "horizontal" ? Plane::horizontal : Plane::vertical;
  }
  void resample(VariantConfig& v) const override { actuator(v).estimation.tick_s = v.timing.tick_s; }

  ModeSet own_modes(const VariantConfig& v) const override { return valve_modes(v.modes, actuator(v).nominal); }
  std::vector<double> continuous_limits(const VariantConfig& v) const override {
    const double motor_n = actuator(v).nominal.motor_force_limit_n();
    return on_servo_valves(v) ? std::vector{motor_n, 1.0, 1.0} : std::vector{motor_n};
  }
  /// The stroke; no faster than a choked valve fills or empties the smaller chamber at atmospheric pressure; pressures from
  /// that to the supply's.
  std::vector<StateRange> state_ranges(const VariantConfig& v) const override {
    const ActuatorParameters& p = actuator(v).nominal;
    const double fastest =
        p.choked_flow * p.gas_constant * p.temperature_k / (p.atmospheric_pressure_pa * p.piston_area_b());
    const StateRange pressure{p.atmospheric_pressure_pa, p.supply_pressure_pa};
    return {{p.position_min_m(), p.position_max_m()}, {-fastest, fastest}, pressure, pressure};
  }
  std::unique_ptr<AnyProblem> problem(const VariantConfig& v) const override {
    return with_model(v, [&]<class M>(M*) { return actuator_problem_of<M>(v).clone(); });
  }
  const ModelTools& tools(const VariantConfig& v) const override {
    return *with_model(v, []<class M>(M*) { return &model_tools<M>(); });
  }
  Estimator own_estimator(const VariantConfig& v) const override {
    EstimatorTuning tuning = actuator(v).estimation;
    tuning.residual = actuator(v).residual;
    Estimator slide = make_estimator(v.estimator, make_model<PneumaticActuator>(v), tuning);
    if (!on_servo_valves(v)) return slide;
    return Estimator(ServoEstimator(std::move(slide), servo_pair(v)));
  }
  std::unique_ptr<Controller> mpc(const VariantConfig& v, const Motion& reference,
                                  const SolverDecorator& decorate) const override {
    return with_model(v, [&]<class M>(M*) { return actuator_mpc<M>(v, reference, decorate); });
  }

  std::unique_ptr<SwitchHealth> health(const VariantConfig& v) const override {
    if (!actuator(v).valve_health) return nullptr;
    return std::make_unique<ValveHealth>(make_model<PneumaticActuator>(v), modes(v), health_tuning(v));
  }
  std::vector<SpareModes> spare_modes(const VariantConfig& v) const override {
    std::vector<SpareModes> spares;
    if (!actuator(v).valve_health) return spares;
    const ModeSet all = modes(v);
    for (const FailedSwitch& failed : ValveHealth::findable(all, health_tuning(v)))
      spares.push_back({failed, with_fault(all, failed.c, failed.fault, v.timing.tick_s, chambers)});
    return spares;
  }

  std::unique_ptr<Guard> guard(const VariantConfig& v) const override {
    std::optional<MotorGains> motor;
    if (actuator(v).hybrid()) motor = actuator(v).motor_gains;
    std::optional<ServoPair> servo;
    if (on_servo_valves(v)) servo = servo_pair(v);
    return std::make_unique<ActuatorGuard>(make_model<PneumaticActuator>(v), modes(v), motor, v.timing.tick_s, servo,
                                           spare_modes(v));
  }
  LadderSettings ladder(const VariantConfig& v) const override { return actuator_ladder(actuator(v).nominal); }
};

}  // namespace

System& actuator_system();
System& actuator_system() {
  static ActuatorSystem system;
  return system;
}

}  // namespace solenoid
