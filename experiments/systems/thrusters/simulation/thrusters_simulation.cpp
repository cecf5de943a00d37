#include "controllers/systems/thrusters/thrusters_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/thrusters/modes.hpp"
#include "core/systems/thrusters/signals.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/plants/simulated_model.hpp"

#include <vector>

namespace solenoid {

System& thrusters_system();
const SimulatedSystem& thrusters_simulation();

namespace {

/// What a scenario of the thrusters says beside what every scenario does.
struct ThrustersScenario {
  double mass_factor = 1.0, thrust_factor = 1.0;             ///< of what the variant believes; inertia goes with mass
  double force_x_n = 0.0, force_y_n = 0.0, torque_nm = 0.0;  ///< from outside
  double pose_sigma_m = 1e-3, angle_sigma_rad = 1e-3;        ///< noise of the channels
};

FreeFlyerParameters plant_parameters(const FreeFlyerParameters& nominal, const ThrustersScenario& own) {
  FreeFlyerParameters p = nominal;
  p.mass_kg *= own.mass_factor;
  p.inertia_kg_m2 *= own.mass_factor;
  p.thrust_n *= own.thrust_factor;
  p.external_force_x_n += own.force_x_n;
  p.external_force_y_n += own.force_y_n;
  p.external_torque_nm += own.torque_nm;
  return p;
}

class ThrustersSimulation final : public SimulatedSystem {
 public:
  const System& system() const override { return thrusters_system(); }

  void read(TableReader& table, ScenarioConfig& s) const override {
    ThrustersScenario& own = s.own.as<ThrustersScenario>();
    const Range factor{0.1, 10.0}, any{-1e3, 1e3}, sigma{0.0, 1.0};
    if (table.has("plant")) {
      TableReader plant = table.table("plant");
      own.mass_factor = plant.number_or("mass_factor", own.mass_factor, factor);
      own.thrust_factor = plant.number_or("thrust_factor", own.thrust_factor, factor);
      own.force_x_n = plant.number_or("force_x_n", own.force_x_n, any);
      own.force_y_n = plant.number_or("force_y_n", own.force_y_n, any);
      own.torque_nm = plant.number_or("torque_nm", own.torque_nm, any);
      plant.finish();
    }
    read_sensing(table, s);
    own.pose_sigma_m = table.number_or("position_sigma_m", own.pose_sigma_m, sigma);
    own.angle_sigma_rad = table.number_or("angle_sigma_rad", own.angle_sigma_rad, sigma);
    TableReader trajectory = table.table("trajectory");
    read_motion(trajectory, thrusters_description(), {}, s);
  }

  std::span<const DrawnQuantity> quantities() const override {
    static const std::vector<DrawnQuantity> all = {{"mass_factor", "plant.mass_factor"},
                                                   {"thrust_factor", "plant.thrust_factor"},
                                                   {"force_x_n", "plant.force_x_n", {-1e3, 1e3}, false, 0.0},
                                                   {"force_y_n", "plant.force_y_n", {-1e3, 1e3}, false, 0.0}};
    return all;
  }
  std::vector<double> conditions(const ScenarioConfig& s) const override {
    return {s.own.as<ThrustersScenario>().mass_factor};
  }

  std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& v, const ScenarioConfig& s,
                                             std::uint64_t seed) const override {
    const ThrustersScenario& own = s.own.as<ThrustersScenario>();
    SimulatedModel<FreeFlyer>::Sensing sensing{.channels = {}, .ideal = s.ideal_sensing, .seed = seed};
    for (std::size_t k = 0; k < 3; ++k)
      sensing.channels.push_back(KalmanChannel<FreeFlyer>::of(k, !s.noise ? 0.0
                                                                 : k < 2  ? own.pose_sigma_m
                                                                          : own.angle_sigma_rad));
    const AxisValues start = s.trajectory.start();
    return std::make_unique<SimulatedModel<FreeFlyer>>(
        FreeFlyer(plant_parameters(thrusters(v).nominal, own)), thruster_modes(v.modes, thrusters(v).nominal),
        Vector<double, 6>{start[0], start[1], start[2], 0, 0, 0}, v.timing.tick_s, std::move(sensing));
  }

  Metrics evaluate(const VariantConfig& v, const ScenarioConfig&, std::span<const TickRecord> ticks,
                   const Consumed& air_kg) const override {
    return evaluate_thrusters_run(ticks, v.timing.tick_s, air_kg, 1e6 * v.timing.period_s());
  }
};

}  // namespace

const SimulatedSystem& thrusters_simulation() {
  static const ThrustersSimulation simulation;
  return simulation;
}

}  // namespace solenoid
