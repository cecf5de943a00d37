#include "controllers/systems/inverter/inverter_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/inverter/modes.hpp"
#include "core/systems/inverter/signals.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/plants/simulated_model.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

namespace solenoid {

System& inverter_system();
const SimulatedSystem& inverter_simulation();

namespace {

/// What a scenario of the inverter says beside what every scenario does.
struct InverterScenario {
  double inductance_factor = 1.0, resistance_factor = 1.0, emf_factor = 1.0;  ///< of what the variant believes
  double frequency_hz = 50.0;                                                 ///< of current and electromotive force
  double current_sigma_a = 2.0;                                               ///< noise of the sensors
};

constexpr double for_ever = std::numeric_limits<double>::infinity();

/// A current vector of this amplitude that turns at this frequency, from angle 0, and changes its amplitude at `step_s`,
/// if that is finite.
Motion rotating_current(double amplitude_a, double after_a, double step_s, double frequency_hz) {
  const auto axis = [&](double phase_rad) {
    Trajectory current(0.0);
    current.harmonic(amplitude_a, frequency_hz, phase_rad, step_s);
    if (std::isfinite(step_s))
      current.harmonic(after_a, frequency_hz, phase_rad + 2 * std::numbers::pi * frequency_hz * step_s, for_ever);
    return current;
  };
  return Motion({axis(0.0), axis(-std::numbers::pi / 2)});
}

InverterParameters plant_parameters(const InverterParameters& nominal, const InverterScenario& own) {
  InverterParameters p = nominal;
  p.inductance_h *= own.inductance_factor;
  p.resistance_ohm *= own.resistance_factor;
  p.emf_amplitude_v *= own.emf_factor;
  p.emf_frequency_hz = own.frequency_hz;
  return p;
}

class InverterSimulation final : public SimulatedSystem {
 public:
  const System& system() const override { return inverter_system(); }

  /// trajectory = { kind = "rotating", amplitude_a, frequency_hz, duration_s, step_at_s, step_to_a }: a current in phase
  /// with the electromotive force, which has the same frequency.
  void read(TableReader& table, ScenarioConfig& s) const override {
    InverterScenario& own = s.own.as<InverterScenario>();
    const Range factor{0.1, 10.0};
    if (table.has("plant")) {
      TableReader plant = table.table("plant");
      own.inductance_factor = plant.number_or("inductance_factor", own.inductance_factor, factor);
      own.resistance_factor = plant.number_or("resistance_factor", own.resistance_factor, factor);
      own.emf_factor = plant.number_or("emf_factor", own.emf_factor, Range::between(0.0, 2.0));
      plant.finish();
    }
    read_sensing(table, s);
    own.current_sigma_a = table.number_or("current_sigma_a", own.current_sigma_a, Range::between(0.0, 100.0));
    TableReader trajectory = table.table("trajectory");
    s.trajectory_kind = trajectory.text_or("kind", "rotating", {"rotating"});
    const double amplitude =
        trajectory.number_or("amplitude_a", InverterParameters().rated_current_a, {0.0, 1e5, true});
    own.frequency_hz = trajectory.number_or("frequency_hz", own.frequency_hz, {0.0, 1e3, true});
    const double duration_s = trajectory.number("duration_s", {0.0, 10.0, true});
    const double step_s = trajectory.has("step_at_s") ? trajectory.number("step_at_s", {0.0, 20.0, true}) : for_ever;
    const double after = trajectory.number_or("step_to_a", amplitude, {0.0, 1e5});
    if (std::isfinite(step_s) != trajectory.has("step_to_a"))
      trajectory.fail("step_to_a", "goes with step_at_s (allowed: both or neither)");
    trajectory.finish();
    s.trajectory = rotating_current(amplitude, after, step_s, own.frequency_hz);
    s.duration_s = duration_s;
    s.setting = fmt::format("{}", own.frequency_hz);
  }

  std::vector<MotionKind> motions() const override {
    return {{"rotating", "amplitude_a, frequency_hz, duration_s, step_at_s, step_to_a",
             "a current vector in phase with the electromotive force, its amplitude stepping once"}};
  }
  std::span<const DrawnQuantity> quantities() const override {
    static const std::vector<DrawnQuantity> all = {{"inductance_factor", "plant.inductance_factor"},
                                                   {"resistance_factor", "plant.resistance_factor"},
                                                   {"emf_factor", "plant.emf_factor", {0.0, 2.0, true}}};
    return all;
  }
  std::vector<double> conditions(const ScenarioConfig& s) const override {
    return {s.own.as<InverterScenario>().inductance_factor};
  }

  std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& v, const ScenarioConfig& s,
                                             std::uint64_t seed) const override {
    const InverterScenario& own = s.own.as<InverterScenario>();
    const InverterLoad model(plant_parameters(inverter(v).nominal, own));
    SimulatedModel<InverterLoad>::Sensing sensing{.channels = {}, .ideal = s.ideal_sensing, .seed = seed};
    for (std::size_t k = 0; k < 2; ++k)
      sensing.channels.push_back(KalmanChannel<InverterLoad>::of(k, s.noise ? own.current_sigma_a : 0.0));
    const AxisValues start = s.trajectory.start();
    const Vector<double, 2> emf = model.emf(0.0);
    return std::make_unique<SimulatedModel<InverterLoad>>(model, inverter_modes(v.modes, inverter(v).nominal),
                                                          Vector<double, 4>{start[0], start[1], emf[0], emf[1]},
                                                          v.timing.tick_s, std::move(sensing));
  }

  std::string real_time_campaign() const override { return "inverter_rig"; }

  Metrics evaluate(const VariantConfig& v, const ScenarioConfig&, std::span<const TickRecord> ticks,
                   const Consumed&) const override {
    return evaluate_inverter_run(ticks, v.timing.tick_s, system().modes(v), 1e6 * v.timing.period_s());
  }
};

}  // namespace

const SimulatedSystem& inverter_simulation() {
  static const InverterSimulation simulation;
  return simulation;
}

}  // namespace solenoid
