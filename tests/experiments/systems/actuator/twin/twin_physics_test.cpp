#include "tests/experiments/systems/actuator/twin/twin_support.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

TwinParameters frictionless(TwinParameters p) {
  p.actuator.static_friction_n = p.actuator.coulomb_friction_n = p.actuator.viscous_friction = 0.0;
  p.integration = {Integration::adaptive, 1, 1e-11};
  return p;
}

/// Internal, kinetic and potential energy and the work left in the atmosphere around the rod [J].
double energy(const TwinPhysics& physics, const TwinState& x) {
  const ActuatorParameters& a = physics.parameters().actuator;
  const double gamma = a.heat_capacity_ratio, r = a.gear_radius_m();
  const double volume_a = a.piston_area_a() * (a.dead_length_a_m + x[position]);
  const double volume_b = a.piston_area_b() * (a.dead_length_b_m - x[position]);
  const double internal = (x[pressure_a] * volume_a + x[pressure_b] * volume_b) / (gamma - 1);
  const double kinetic = 0.5 * a.equivalent_mass_kg() * x[velocity] * x[velocity];
  // F_grav = W - tau/r sin(y/r) has the potential -W y - tau cos(y/r).
  const double gravity = -a.block_mass_kg * a.gravity * x[position] - a.gravity_torque_nm() * std::cos(x[position] / r);
  const double rod = a.atmospheric_pressure_pa * (a.piston_area_a() - a.piston_area_b()) * x[position];
  return internal + kinetic + gravity + rod;
}

TEST(TwinPhysics, ClosedFrictionlessChambersKeepMassAndEnergy) {
  for (const char* law : {"model", "heat_transfer"}) {
    TwinBench bench(frictionless(twin_from("thermal = { law = \"" + std::string(law) + "\" }")), "two_way", 0.05);
    bench.state[velocity] = 0.3;
    const TwinState start = bench.state;
    const double before = energy(bench.physics, start);
    double fastest = 0;
    for (int i = 0; i < 10; ++i) {
      bench.run(0.1);
      fastest = std::max(fastest, std::abs(bench.state[velocity] - start[velocity]));
      EXPECT_NEAR(energy(bench.physics, bench.state), before, 1e-6);
      EXPECT_EQ(bench.state[twin_mass_a], start[twin_mass_a]);
      EXPECT_EQ(bench.state[twin_mass_b], start[twin_mass_b]);
    }
    EXPECT_GT(fastest, 0.3);  // it swings; energy was exchanged
  }
}

TEST(TwinPhysics, ManyHeatsMakeTheChambersIsothermalAndNoneAdiabatic) {
  const auto pressure_times_volume_power = [](const TwinBench& bench, double n) {
    const ActuatorParameters& a = bench.physics.parameters().actuator;
    return bench.state[pressure_a] * std::pow(a.dead_length_a_m + bench.state[position], n);
  };
  for (const auto& [heat, exponent] : {std::pair{0.0, 1.4}, std::pair{1e5, 1.0}}) {
    TwinParameters p = frictionless(twin_from("thermal = { law = \"heat_transfer\" }"));
    p.thermal.heat_transfer = heat;
    TwinBench bench(p, "two_way", 0.05);
    bench.state[velocity] = 0.1;
    const double before = pressure_times_volume_power(bench, exponent);
    bench.run(0.15);
    EXPECT_GT(std::abs(bench.state[position] - 0.05), 0.002);
    EXPECT_NEAR(pressure_times_volume_power(bench, exponent) / before, 1.0, 5e-4) << heat;
  }
}

TEST(TwinPhysics, PolytropicExponentsAreThoseOfTheClosedAndTheFillingChamber) {
  TwinParameters p =
      frictionless(twin_from("thermal = { law = \"polytropic\", alpha_in = 1.3, alpha_out = 1.0, exponent = 1.2 }"));
  const TwinPhysics physics(p);
  TwinState x = physics.state_at_rest(0.05);
  x[velocity] = 0.2;
  const double length = p.actuator.dead_length_a_m + 0.05;
  const TwinState closed = physics.rates(x, {0, 0, 0, 0}, 0.0, SlideMotion::up);
  EXPECT_NEAR(closed[pressure_a], -1.2 * x[pressure_a] * 0.2 / length, 1e-6);
  x[velocity] = 0.0;
  const TwinState filling = physics.rates(x, {1, 0, 0, 0}, 0.0, SlideMotion::held);
  EXPECT_NEAR(filling[pressure_a], 1.3 * 287.0 * 293.0 * filling[twin_mass_a] / (p.actuator.piston_area_a() * length),
              1e-6);
}

TEST(TwinPhysics, AirDrawnLessAirVentedIsInTheChambers) {
  TwinBench bench(full_twin());
  const auto chambers = [&] { return bench.state[twin_mass_a] + bench.state[twin_mass_b]; };
  const double before = chambers();
  for (int i = 0; i < 60; ++i) {
    bench.command(static_cast<SwitchPattern>(i * 7 % 4));
    bench.run(0.01);
  }
  EXPECT_GT(bench.state[twin_drawn], 1e-5);
  EXPECT_GT(bench.state[twin_vented], 1e-5);
  EXPECT_NEAR(chambers() - before, bench.state[twin_drawn] - bench.state[twin_vented], 1e-14);
}

TEST(TwinPhysics, AReservoirWithoutRegulatorLosesWhatIsDrawn) {
  TwinParameters p = full_twin();
  p.supply.conductance = 0.0;
  p.supply.volume_m3 = 2e-4;
  TwinBench bench(p);
  bench.command(1);
  bench.run(0.2);
  const double lost = (p.actuator.supply_pressure_pa - bench.state[twin_supply]) * 2e-4 / (287.0 * 293.0);
  EXPECT_GT(lost, 1e-5);
  EXPECT_NEAR(lost, bench.state[twin_drawn], 1e-12);
}

TEST(TwinPhysics, ARegulatorBringsTheSupplyBack) {
  TwinParameters p = full_twin();
  p.supply = {true, 1e-4, 1e-7, 2e-3};
  TwinBench bench(p, "two_way");
  bench.command(1);
  bench.run(0.02);
  const double drooped = p.actuator.supply_pressure_pa - bench.state[twin_supply];
  EXPECT_GT(drooped, 100.0);
  bench.command(0);
  bench.run(0.01);
  const double start = p.actuator.supply_pressure_pa - bench.state[twin_supply];
  bench.run(0.05);
  // Closed valves: first-order recovery with V / (R T conductance).
  const double time_constant = 1e-4 / (287.0 * 293.0 * 1e-7);
  EXPECT_NEAR((p.actuator.supply_pressure_pa - bench.state[twin_supply]) / start, std::exp(-0.05 / time_constant),
              1e-6);
}

TEST(TwinPhysics, LuGreSlidesWithTheModelsFrictionAndSticksElastically) {
  const TwinParameters p = twin_from("friction = { law = \"lugre\", bristle_stiffness = 1e5 }");
  const TwinPhysics physics(p);
  const PneumaticActuator& model = physics.model();
  for (const double v : {-0.3, -0.1, 0.1, 0.25}) {
    TwinState x = physics.state_at_rest(0.05);
    x[velocity] = v;
    x[twin_bristle] = physics.bristle_after(0.0, v, 1.0);
    const double force = physics.applied_force(x, 0.0) -
                         p.actuator.equivalent_mass_kg() * physics.rates(x, {}, 0.0, SlideMotion::smooth)[velocity];
    EXPECT_NEAR(force, model.sliding_friction<double>(v, v > 0 ? 1.0 : -1.0), 1e-9) << v;
  }
  // Pushed below static friction and let go again, the slide comes back to where it was but for a creep of micrometres.
  TwinParameters level = p;
  level.actuator.plane = Plane::horizontal;
  TwinBench bench(level, "two_way");
  bench.run(0.2, 0.4);
  const double pushed = bench.state[position] - 0.05;
  EXPECT_GT(pushed, 0.2e-6);
  EXPECT_LT(pushed, 1.4 / 1e5);
  bench.run(0.2, 0.0);
  EXPECT_LT(std::abs(bench.state[position] - 0.05), 0.5 * pushed);
}

TEST(TwinPhysics, BristleStepIsTheExactSolution) {
  const TwinPhysics physics(twin_from("friction = { law = \"lugre\" }"));
  for (const double v : {-0.2, -1e-4, 3e-3, 0.5}) {
    TwinState x = physics.state_at_rest(0.05);
    x[velocity] = v;
    double z = 4e-6;
    constexpr int steps = 200000;
    constexpr double h = 1e-4 / steps;
    for (int i = 0; i < steps; ++i) {  // Heun
      x[twin_bristle] = z;
      const double first = physics.rates(x, {}, 0.0, SlideMotion::smooth)[twin_bristle];
      x[twin_bristle] = z + h * first;
      z += h / 2 * (first + physics.rates(x, {}, 0.0, SlideMotion::smooth)[twin_bristle]);
    }
    EXPECT_NEAR(physics.bristle_after(4e-6, v, 1e-4), z, 1e-12) << v;
  }
}

TEST(TwinPhysics, MotorForceArrivesThroughLagAndBacklash) {
  TwinParameters p =
      frictionless(twin_from("gear = { law = \"backlash\", backlash_m = 1e-4 }\nmotor = { lag_s = 2e-3 }"));
  p.actuator.plane = Plane::horizontal;
  TwinBench bench(p, "two_way");
  const double rotor_kg = 1.38e-5 / (0.0075 * 0.0075);
  bench.run(2e-3, 4.0);
  EXPECT_NEAR(bench.state[twin_motor], 4.0 * (1 - std::exp(-1.0)), 1e-9);
  // The rotor crosses half its play, 50 um, before the slide feels anything.
  EXPECT_LT(bench.state[twin_rotor_y] - 0.05, 5e-5);
  EXPECT_NEAR(bench.state[velocity], 0.0, 1e-15);
  bench.run(0.1, 4.0);
  EXPECT_GT(bench.state[position], 0.05 + 1e-5);
  // Momentum of slide and rotor is the impulse of motor and cylinder: push without the pneumatic spring's share.
  p.motor_lag_s = 0.0;
  const TwinPhysics physics(p);
  TwinState x = physics.state_at_rest(0.05);
  x[twin_rotor_y] += 2e-4;
  const TwinState dx = physics.rates(x, {}, 4.0, SlideMotion::up);
  const double total = rotor_kg * dx[twin_rotor_v] + p.actuator.equivalent_mass_kg() * dx[velocity];
  EXPECT_NEAR(total, 4.0 + physics.model().cylinder_force(x[pressure_a], x[pressure_b]), 1e-9);
  x[twin_rotor_y] = 0.05;
  EXPECT_NEAR(physics.rates(x, {}, 4.0, SlideMotion::up)[twin_rotor_v], 4.0 / rotor_kg, 1e-9);
}

TEST(TwinPhysics, StartsAtRestAndStaysThere) {
  for (const char* law : {"model", "lugre"}) {
    TwinBench bench(twin_from("friction = { law = \"" + std::string(law) + "\" }"), "three_way",
                    ActuatorParameters{}.equilibrium_position_m());
    bench.run(0.5);
    EXPECT_NEAR(bench.state[position], ActuatorParameters{}.equilibrium_position_m(), 1e-7) << law;
  }
}

}  // namespace
}  // namespace solenoid
