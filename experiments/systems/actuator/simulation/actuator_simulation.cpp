#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/metrics.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "experiments/systems/actuator/simulation/model_plant.hpp"
#include "experiments/systems/actuator/simulation/thesis_cell.hpp"
#include "experiments/systems/actuator/simulation/valve_parts.hpp"
#include "experiments/systems/actuator/twin/twin_plant.hpp"
#include "experiments/systems/actuator/twin/twin_sensing.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {

System& actuator_system();

namespace {

/// Resolutions of what is kept over time.
constexpr double length_step_m = 1e-7, pressure_step_pa = 10.0, force_step_n = 1e-3, opening_step = 1e-4;

/// Parameters of the plant "model".
ActuatorParameters model_parameters(const VariantConfig& variant, const ScenarioConfig& scenario) {
  ActuatorParameters p = actuator(scenario).mismatch.applied_to(actuator(variant).nominal);
  p.payload_mass_kg = actuator(scenario).payload_kg;
  p.plane = actuator(scenario).plane;
  return p;
}

/// The motion must lie inside the stroke.
void check_stroke(const TableReader& table, const Motion& motion) {
  const ActuatorParameters unloaded;
  const auto [low, high] = motion.axes().front().range();
  if (low < unloaded.position_min_m() || high > unloaded.position_max_m())
    table.fail("trajectory",
               fmt::format("reaches from {:.4g} to {:.4g} m (allowed: inside the stroke, {:.4g} to {:.4g} m)", low,
                           high, unloaded.position_min_m(), unloaded.position_max_m()));
}

/// The commands of servo valves in place of modes that there are none of.
void show_servo_commands(TraceLayout& layout) {
  const auto modes = std::ranges::find_if(layout.panels, &TraceLayout::Panel::modes);
  *modes = {.label = "servo valves", .unit = "1", .curves = {}, .zero = true, .limit = 0.1};
  for (const std::size_t input : {opening_a_input, opening_b_input}) {
    const Signal& signal = servo_description().continuous[input];
    layout.kept.push_back({signal.name, signal.unit, opening_step, TraceLayout::Source::continuous, input});
    modes->curves.push_back({signal.name, signal.label});
  }
}

/// ActuatorSimulation::spoiled() where openings are continuous.
Command spoiled_servo(const ActuationFault& fault, const Command& wanted, const Command& last) {
  Command reached = wanted;
  double &a = reached.continuous[opening_a_input], &b = reached.continuous[opening_b_input];
  if (fault.kind == "stuck") a = last.continuous[opening_a_input], b = last.continuous[opening_b_input];
  if (fault.kind == "swapped") std::swap(a, b);
  if (fault.kind == "lost") a = std::min(a, 0.0), b = std::min(b, 0.0);
  return reached;
}

/// Mode sets of one coil to fill a chamber and at most one to exhaust it, whose wires or ports can be exchanged.
constexpr const char* one_coil_sets = "two_way three_way three_mode seven_mode";

ActuationFault of_plant(const char* part, const char* kind, const char* unit, double most) {
  ActuationFault fault;
  fault.target = part;
  fault.kind = kind;
  fault.unit = unit;
  fault.of_plant = true;
  fault.most = most;
  return fault;
}

/// Coils of a chamber exchanged: of its two valves each does what the other should; of a single three-way valve supply
/// and exhaust are at each other's ports, so that it fills while its coil is off.
SwitchPattern with_coils_exchanged(SwitchPattern wanted, int coils_a_chamber, int chamber) {
  const int first = chamber * coils_a_chamber;
  if (coils_a_chamber == 1) return wanted ^ (SwitchPattern{1} << first);
  const SwitchPattern pair = (wanted >> first) & 3u, turned = ((pair & 1u) << 1) | (pair >> 1);
  return (wanted & ~(SwitchPattern{3} << first)) | (turned << first);
}

class ActuatorSimulation final : public SimulatedSystem {
 public:
  const System& system() const override { return actuator_system(); }

  /// The motion starts at the hanging equilibrium of the unloaded arm unless it says from_m.
  void read(TableReader& table, ScenarioConfig& s) const override {
    read_actuator_scenario(table, s);
    TableReader trajectory = table.table("trajectory");
    read_motion(trajectory, actuator_description(), {ActuatorParameters().equilibrium_position_m()}, s);
    check_stroke(table, s.trajectory);
  }

  /// The loaded arm must hang at rest somewhere, in the model of each variant; the twin's sensors are sampled ten times a
  /// millisecond.
  void check(const ScenarioConfig& s, const VariantConfig& v,
             const std::function<std::string(const char*)>& where) const override {
    if (actuator(s).plane != Plane::horizontal) try {
        model_parameters(v, s).equilibrium_position_m();
      } catch (const ConfigError& error) {
        throw ConfigError(
            fmt::format("{}: key 'payload_kg': with variant '{}': {}", where("payload_kg"), v.name, error.what()));
      }
    const double intervals = v.timing.tick_s / SensingChain::interval_s;
    if (actuator(s).plant == "twin" && std::abs(intervals - std::round(intervals)) > 1e-6)
      throw ConfigError(
          fmt::format("{}: key 'timing': ticks of {:g} ms with plant = \"twin\" (allowed: multiples of {:g} ms)",
                      where("timing"), 1e3 * v.timing.tick_s, 1e3 * SensingChain::interval_s));
  }

  std::span<const DrawnQuantity> quantities() const override {
    static const std::vector<DrawnQuantity> all = {{"payload_kg", "payload_kg", Range::between(0.0, 10.0), false, 0.0},
                                                   {"friction", "mismatch.friction"},
                                                   {"flow", "mismatch.flow"},
                                                   {"supply", "mismatch.supply"},
                                                   {"delay", "mismatch.delay"},
                                                   {"inertia", "mismatch.inertia"},
                                                   {.name = "noise_factor", .path = "noise_factor", .optional = true}};
    return all;
  }
  std::vector<double> conditions(const ScenarioConfig& s) const override { return {actuator(s).payload_kg}; }

  std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& v, const ScenarioConfig& s,
                                             std::uint64_t seed) const override {
    check(s, v, [](const char*) { return std::string("plant"); });
    const ActuatorScenario& own = actuator(s);
    const double start_m = s.trajectory.start()[0];
    if (own.plant == "twin")
      return std::make_unique<TwinPlant>(twin_for(own.twin, {own.plane, own.payload_kg, own.mismatch}), v.modes,
                                         start_m, TwinPlant::Sensing{s.ideal_sensing, s.noise, seed});
    auto plant = std::make_unique<ModelPlant>(
        model_parameters(v, s), v.modes, start_m,
        ModelPlant::Sensing{s.ideal_sensing, s.noise, own.sensing_chain, {}, seed}, v.timing.tick_s);
    if (own.kick) plant->push_at(own.kick->at_s, own.kick->speed_m_s);
    return plant;
  }

  /// Of the potentiometer; pressures are not watched by their noise, which a filter draws out.
  std::vector<ChannelNoise> noise(const ScenarioConfig& s) const override {
    const ActuatorScenario& own = actuator(s);
    const bool twin = own.plant == "twin";
    const SensingEffects& e = own.twin.sensing;
    const ModelSensingSettings chain;
    const auto step = [](double low, double high, int bits) { return bits > 0 ? std::ldexp(high - low, -bits) : 0.0; };
    ChannelNoise position;
    if (s.noise || own.sensing_chain) position.sigma = twin ? e.position_sigma_m : chain.position_sigma_m;
    if (twin) position.quantum = step(e.position_low_m, e.position_high_m, e.converter_bits);
    if (!twin && own.sensing_chain) position.quantum = step(chain.position_low_m, chain.position_high_m, chain.bits);
    return {position, {}, {}};
  }
  std::string real_time_campaign() const override { return "rig"; }
  std::span<const ActuationFault> actuation_faults() const override {
    static const std::vector<ActuationFault> all = {{"valves", "stuck"},
                                                    {"valves", "swapped"},
                                                    {"supply", "lost"},
                                                    {.target = "coils_a", .kind = "swapped", .needs = one_coil_sets},
                                                    {.target = "coils_b", .kind = "swapped", .needs = one_coil_sets},
                                                    {"motor", "inverted"},
                                                    {"motor", "lost"},
                                                    of_plant("supply", "factor", "FACTOR", 2.0),
                                                    of_plant("chamber_a", "leaking", "SHARE", 1.0),
                                                    of_plant("chamber_b", "leaking", "SHARE", 1.0),
                                                    {"coil", "stuck_open", SwitchFaultKind::stuck_on},
                                                    {"coil", "stuck_closed", SwitchFaultKind::stuck_off},
                                                    {"coil", "leaking", SwitchFaultKind::leaking, "SHARE"},
                                                    {"coil", "slow", SwitchFaultKind::slow, "S"}};
    return all;
  }
  /// Swapped valves exchange the chambers, swapped coils what is done to one; an inverted motor pulls the other way; a
  /// lost supply leaves the supply valves without effect.
  Command spoiled(const VariantConfig& v, const ActuationFault& fault, const Command& wanted,
                  const Command& last) const override {
    if (fault.target == "motor") {
      Command turned = wanted;
      turned.continuous[0] = fault.kind == "lost" ? 0.0 : -wanted.continuous[0];
      return turned;
    }
    if (on_servo_valves(v)) return spoiled_servo(fault, wanted, last);
    const ModeSet modes = this->system().modes(v);
    const int coils_a_chamber = modes.switch_count() / 2;
    const SwitchPattern chamber = (SwitchPattern{1} << coils_a_chamber) - 1;
    SwitchPattern supply = 0;
    for (int c = 0; c < modes.switch_count(); ++c) {
      const auto point = modes.point(SwitchPattern{1} << c);
      if (point[fill_a] + point[fill_b] > 0.0) supply |= SwitchPattern{1} << c;
    }
    Command reached = wanted;
    if (fault.kind == "stuck") reached.switches = last.switches;
    if (fault.target == "coils_a" || fault.target == "coils_b")
      reached.switches = with_coils_exchanged(wanted.switches, coils_a_chamber, fault.target == "coils_b" ? 1 : 0);
    else if (fault.kind == "swapped")
      reached.switches =
          ((wanted.switches & chamber) << coils_a_chamber) | ((wanted.switches >> coils_a_chamber) & chamber);
    if (fault.kind == "lost") reached.switches &= ~supply;
    return reached;
  }

  Metrics evaluate(const VariantConfig& v, const ScenarioConfig& s, std::span<const TickRecord> ticks,
                   const Consumed& air_kg) const override {
    Metrics m = evaluate_actuator_run(ticks, s.trajectory, v.timing.tick_s, air_kg, 1e6 * v.timing.period_s());
    const ValveHardware& hardware = valve_hardware(v.modes);
    m["life_years"] = life_years(hardware, m["busiest_coil_per_s"]);
    m["valves_usd"] = hardware.price_usd;
    return m;
  }

  /// The thesis's cell: {table, measured, rmse_mm, mae_mm, sse_mm, ssa_mm}, figures as printed.
  nlohmann::ordered_json published(const VariantConfig& v, const ScenarioConfig& s) const override {
    const std::optional<ThesisCell> cell = thesis_cell(v, s);
    if (!cell) return {};
    const auto printed = [](const PrintedNumber& n) { return fmt::format("{}{}", n.upper_bound ? "<" : "", n.value); };
    nlohmann::ordered_json json = {{"table", cell->table},
                                   {"measured", cell->measured},
                                   {"rmse_mm", printed(cell->rmse_mm)},
                                   {"mae_mm", printed(cell->mae_mm)}};
    if (cell->sse_mm) json["sse_mm"] = printed(*cell->sse_mm);
    if (cell->ssa_mm) json["ssa_mm"] = printed(*cell->ssa_mm);
    return {{"thesis", json}};
  }

  /// The five plots of the thesis's figures 6-3 to 7-9; the cylinder's force is the plant's, in (4.3).
  TraceLayout layout(const VariantConfig& v, const ScenarioConfig& s) const override {
    const PneumaticActuator plant(actuator(s).mismatch.applied_to(actuator(v).nominal));
    const double none = plant.cylinder_force(0.0, 0.0);
    using Source = TraceLayout::Source;
    TraceLayout layout;
    layout.kept = {{"reference", "m", length_step_m, Source::reference},
                   {"position", "m", length_step_m, Source::state, position, position_channel},
                   {"pressure_a", "Pa", pressure_step_pa, Source::state, pressure_a, pressure_a_channel},
                   {"pressure_b", "Pa", pressure_step_pa, Source::state, pressure_b, pressure_b_channel},
                   {"mode", "", 1.0, Source::mode},
                   {"motor", "N", force_step_n, Source::continuous}};
    layout.derived = {{"error", "m", length_step_m, 0.0, {{"reference", 1.0}, {"position", -1.0}}},
                      {"cylinder",
                       "N",
                       force_step_n,
                       none,
                       {{"pressure_a", plant.cylinder_force(1.0, 0.0) - none},
                        {"pressure_b", plant.cylinder_force(0.0, 1.0) - none}}}};
    layout.panels = {{.label = "position",
                      .unit = "mm",
                      .scale = 1e3,
                      .curves = {{"position", "actual"}, {"reference", "desired", true}}},
                     {.label = "error", .unit = "mm", .scale = 1e3, .curves = {{"error", "error"}}, .zero = true},
                     {.label = "valve mode", .curves = {{"mode", "valve mode"}}, .modes = true},
                     {.label = "cylinder force",
                      .unit = "N",
                      .curves = {{"cylinder", "cylinder"}},
                      .zero = true,
                      .choice = "fourth"},
                     {.label = "pressure",
                      .unit = "kPa",
                      .scale = 1e-3,
                      .curves = {{"pressure_a", "pressure A"}, {"pressure_b", "pressure B"}},
                      .choice = "fourth"},
                     {.label = "motor force",
                      .unit = "N",
                      .curves = {{"motor", "motor"}},
                      .zero = true,
                      .limit = std::max(actuator(v).nominal.motor_force_limit_n(), 1.0)}};
    if (on_servo_valves(v)) show_servo_commands(layout);
    return layout;
  }
};

}  // namespace

const SimulatedSystem& actuator_simulation() {
  static const ActuatorSimulation simulation;
  return simulation;
}

}  // namespace solenoid
