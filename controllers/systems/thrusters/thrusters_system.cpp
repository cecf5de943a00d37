#include "controllers/model_system.hpp"
#include "controllers/systems/thrusters/thrusters_variant.hpp"
#include "core/systems/thrusters/modes.hpp"
#include "core/systems/thrusters/signals.hpp"

#include <limits>
#include <numbers>
#include <vector>

namespace solenoid {
namespace {

constexpr double floor_m = 5.0;  // from its middle to its ends
constexpr double any = std::numeric_limits<double>::infinity();

/// What the filter finds beyond the state goes into the prediction: tracking without offset.
struct OutsideForces {
  void believe(const EstimateDetail& found, FreeFlyer& model) const noexcept {
    model.set_load({found.belief[0], found.belief[1], found.belief[2]});
  }
  Vector<double, 0> apply(const FreeFlyer&, const ReferenceSample&, const Vector<double, 6>&,
                          const Vector<double, 0>& planned) const noexcept {
    return planned;
  }
};

std::vector<VariantKey> thrusters_keys() {
#define OWN(member) VariantKey::At<double>([](VariantConfig& v) -> double& { return thrusters(v).member; })
  std::vector<VariantKey> keys;
  const KeyGroup all{keys, "estimation"};
  all.add("estimation.position_sigma_m", OWN(pose_sigma_m), Range::positive(), "m", "white noise of x and y");
  all.add("estimation.angle_sigma_rad", OWN(angle_sigma_rad), Range::positive(), "rad", "of the angle");
  all.add("estimation.force_sigma", OWN(force_sigma), Range::non_negative(), "m/s2",
          "acceleration from outside, stationary; of `disturbance_kalman`");
  all.add("estimation.turn_sigma", OWN(turn_sigma), Range::non_negative(), "rad/s2",
          "angular acceleration from outside; of `disturbance_kalman`");
#undef OWN
  return keys;
}

class ThrustersSystem final : public ModelSystem<FreeFlyer, OutsideForces> {
 public:
  ThrustersSystem()
      : ModelSystem(thrusters_description(),
                    {.mode_sets = thruster_mode_sets(),
                     .estimators = {{"kalman", "extended Kalman filter over the pose"},
                                    {"disturbance_kalman",
                                     "the same with a force and a torque from outside: no offset under them"}}}) {
    add_keys(thrusters_keys());
  }

  VariantConfig defaults() const override {
    VariantConfig v;
    v.modes = "single";
    v.estimator = "kalman";
    v.solver = "branch_and_bound";
    v.horizon = {90, {1, 1, 2, 2, 3}};
    v.cost.tracking = {10, 10, 3, 10, 10, 3};
    v.cost.terminal = {200, 200, 60, 200, 200, 60};
    v.cost.consumption = 20.0;
    return v;
  }
  void read(TableReader& table, VariantConfig& v) const override {
    thrusters(v).nominal = read_model_table(table, thrusters(v).nominal, read_free_flyer);
  }
  ModeSet own_modes(const VariantConfig& v) const override { return thruster_modes(v.modes, thrusters(v).nominal); }
  FreeFlyer model(const VariantConfig& v) const override { return FreeFlyer(thrusters(v).nominal); }
  /// The floor in which it may be, any angle, and speeds beyond those of its tasks.
  std::vector<StateRange> state_ranges(const VariantConfig&) const override {
    const StateRange place{-floor_m, floor_m}, speed{-0.5, 0.5};
    return {place, place, {-std::numbers::pi, std::numbers::pi}, speed, speed, {-1.0, 1.0}};
  }
  KalmanSetup<FreeFlyer> filter(const VariantConfig& v) const override {
    const ThrustersVariant& own = thrusters(v);
    KalmanSetup<FreeFlyer> setup;
    for (std::size_t k = 0; k < 3; ++k)
      setup.channels.push_back(KalmanChannel<FreeFlyer>::of(k, k < 2 ? own.pose_sigma_m : own.angle_sigma_rad));
    setup.process_sigma = {0, 0, 0, 1e-3, 1e-3, 2e-3};
    setup.start_sigma = {0.01, 0.01, 0.01, 0.01, 0.01, 0.01};
    if (v.estimator != "disturbance_kalman") return setup;
    for (std::size_t k = 3; k < 6; ++k) {
      KalmanDisturbance<FreeFlyer> d{.sigma = k < 5 ? own.force_sigma : own.turn_sigma, .drift = 1e-3};
      d.states[k] = 1.0;
      setup.disturbances.push_back(d);
    }
    return setup;
  }
  Vector<double, 6> rest() const override { return {any, any, any, 0.05, 0.05, 0.1}; }
  /// A floor of ten metres, and a pose that cannot jump.
  LadderSettings ladder(const VariantConfig&) const override {
    LadderSettings settings;
    const SensorBounds position{-10.0, 10.0, -20.0, 20.0, 1e-3, 0.1, 1e-3};
    const SensorBounds angle{-1e3, 1e3, -2e3, 2e3, 1e-3, 0.2, 1e-3};
    settings.plausibility.channels = {position, position, angle};
    settings.limits = {{.low = -floor_m, .high = floor_m}, {.low = -floor_m, .high = floor_m}, {}};
    settings.needed_to_stop = {0, 1, 2};
    return settings;
  }
};

}  // namespace

System& thrusters_system();
System& thrusters_system() {
  static ThrustersSystem system;
  return system;
}

}  // namespace solenoid
