#include "core/systems/actuator/signals.hpp"
#include "tests/experiments/systems/actuator/twin/twin_support.hpp"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using ::testing::HasSubstr;

TEST(TwinFlow, OrificeIsContinuousChokesAndReverses) {
  const Iso6358 orifice(1e-9, 0.4, 0.95);
  const double up = 250e3, t = 293.0;
  const auto flow = [&](double ratio) { return orifice.flow(up, t, ratio * up, t); };
  EXPECT_DOUBLE_EQ(flow(0.1), flow(0.39));
  EXPECT_NEAR(flow(0.4 - 1e-9), flow(0.4 + 1e-9), 1e-12 * flow(0.4));
  EXPECT_NEAR(flow(0.95 - 1e-12) / flow(0.95 + 1e-12), 1.0, 1e-9);
  EXPECT_DOUBLE_EQ(flow(1.0), 0.0);
  EXPECT_NEAR(flow(0.99) / flow(0.96), 0.01 / 0.04, 1e-9);  // laminar: linear in the ratio
  EXPECT_NEAR(flow(0.1), 1e-9 * 1.185 * up * std::sqrt(293.15 / 293.0), 1e-12);
  EXPECT_DOUBLE_EQ(orifice.flow(0.7 * up, t, up, t), -flow(0.7));
}

TEST(TwinFlow, FittedConductancesAreTheLeastSquaresOnes) {
  const PneumaticActuator model;
  const ActuatorParameters& p = model.parameters();
  const ValveOrifices fitted = fitted_orifices(model, 0.4, 0.95);
  const auto misfit = [&](double factor) {
    const Iso6358 fill(factor * fitted.fill.conductance(), 0.4, 0.95);
    const Iso6358 exhaust(factor * fitted.exhaust.conductance(), 0.4, 0.95);
    std::pair<double, double> sum{0, 0};
    for (double pressure = p.atmospheric_pressure_pa; pressure < p.supply_pressure_pa; pressure += 375.0) {
      const double f = fill.flow(p.supply_pressure_pa, 293, pressure, 293) - model.fill_flow<double>(pressure);
      const double e =
          -exhaust.flow(pressure, 293, p.atmospheric_pressure_pa, 293) - model.exhaust_flow<double>(pressure);
      sum.first += f * f;
      sum.second += e * e;
    }
    return sum;
  };
  const auto best = misfit(1.0);
  for (const double factor : {0.97, 1.03}) {
    EXPECT_LT(best.first, misfit(factor).first);
    EXPECT_LT(best.second, misfit(factor).second);
  }
}

TEST(TwinFlow, FillFromALowerSupplyIsTheModelsAtThatSupply) {
  ActuatorParameters low;
  low.supply_pressure_pa = 220e3;
  low.choked_flow *= 220e3 / ActuatorParameters{}.supply_pressure_pa;
  const PneumaticActuator model, other(low);
  for (const double pressure : {90e3, 110e3, 120e3, 180e3, 219e3, 230e3})
    EXPECT_NEAR(model.fill_flow<double>(pressure, 220e3), other.fill_flow<double>(pressure), 1e-15);
  EXPECT_EQ(model.fill_flow<double>(180e3, model.parameters().supply_pressure_pa), model.fill_flow<double>(180e3));
}

ModeSet three_way() { return valve_modes("three_way", ActuatorParameters{}); }

TEST(TwinValves, HalfOpenAtTheDelayOfTheThesis) {
  ValveActuation valves(three_way(), {1e-3, 0.8e-3, 0.0}, 1);
  valves.command(1, 0.0);
  EXPECT_EQ(valves.opening(0, 3.49e-3), 0.0);
  EXPECT_NEAR(valves.opening(0, 4e-3), 0.5, 1e-12);
  EXPECT_EQ(valves.opening(0, 4.51e-3), 1.0);
  EXPECT_EQ(valves.opening(1, 1.0), 0.0);
  EXPECT_NEAR(valves.mean_opening(0, 3.5e-3, 4.5e-3), 0.5, 1e-12);
  EXPECT_NEAR(valves.mean_opening(0, 3e-3, 6e-3), (0.5 + 1.5) / 3, 1e-12);
  valves.command(0, 5e-3);
  EXPECT_NEAR(valves.opening(0, 6e-3), 0.5, 1e-12);
  EXPECT_EQ(valves.opening(0, 6.41e-3), 0.0);
}

TEST(TwinValves, WithoutTravelTheyAreTheDelayLines) {
  const ModeSet modes = three_way();
  const SwitchTiming timing(modes, 1e-3);
  DelayLines lines(0);
  ValveActuation valves(modes, {}, 1);
  std::mt19937_64 random(3);
  for (int k = 0; k < 2000; ++k) {
    if (random() % 3 == 0) {
      const auto pattern = static_cast<SwitchPattern>(random() % 4);
      lines.command(pattern, timing);
      valves.command(pattern, 1e-3 * k);
    }
    for (std::size_t c = 0; c < 2; ++c)
      ASSERT_EQ(valves.opening(c, 1e-3 * k + 5e-4), (lines.effective() >> c) & 1u) << "tick " << k;
    lines.advance(1);
    valves.settle(1e-3 * k + 5e-4);
  }
}

TEST(ValveActuation, FaultsChangeOpeningsAndLeaveThePlungerUnderneath) {
  const ModeSet modes = three_way();
  const double rise = modes.switches()[0].rise_delay_s, fall = modes.switches()[0].fall_delay_s;
  ValveActuation valves(modes, {1e-3, 0.8e-3, 0.0}, 1), sound(modes, {1e-3, 0.8e-3, 0.0}, 1);
  const auto both = [&](SwitchPattern pattern, double time_s) {
    valves.command(pattern, time_s);
    sound.command(pattern, time_s);
  };
  both(0b01, 0.0);
  valves.fail(0, {SwitchFaultKind::leaking, 0.25}, 0.0);
  for (const double t : {0.001, rise, rise + 0.3e-3, 0.01}) {
    EXPECT_DOUBLE_EQ(valves.opening(0, t), 0.25 + 0.75 * sound.opening(0, t));
    EXPECT_NEAR(valves.mean_opening(0, t, t + 1e-4), 0.25 + 0.75 * sound.mean_opening(0, t, t + 1e-4), 1e-12);
    EXPECT_EQ(valves.opening(1, t), 0.0);
  }
  valves.fail(0, {SwitchFaultKind::stuck_off}, 0.01);
  EXPECT_EQ(valves.opening(0, 0.011), 0.0);
  valves.fail(0, {SwitchFaultKind::stuck_on}, 0.012);
  both(0b00, 0.02);
  EXPECT_EQ(valves.opening(0, 0.03), 1.0);
  valves.fail(0, {}, 0.03);
  EXPECT_EQ(valves.opening(0, 0.031), 0.0);
  valves.fail(0, {SwitchFaultKind::slow, 0.01}, 0.04);
  both(0b01, 0.04);
  EXPECT_NEAR(valves.opening(0, 0.04 + rise + 0.01), 0.5, 1e-9);  // half open at the delay, and so much later
  EXPECT_EQ(sound.opening(0, 0.04 + rise + 0.01), 1.0);
  both(0b00, 0.08);
  EXPECT_NEAR(valves.opening(0, 0.08 + fall + 0.01), 0.5, 1e-9);
}

TEST(TwinValves, MeanOpeningIsTheIntegralAndKinksAreWhereSlopesChange) {
  ValveActuation valves(three_way(), {3e-3, 1.5e-3, 0.3e-3}, 9);
  std::mt19937_64 random(4);
  for (int k = 0; k < 400; ++k) {
    const double now = 1e-3 * k, next = now + 1e-3;
    if (random() % 4 == 0) valves.command(static_cast<SwitchPattern>(random() % 4), now);
    valves.settle(now);
    for (std::size_t c = 0; c < 2; ++c) {
      double sum = 0;
      constexpr int points = 2000;
      for (int i = 0; i < points; ++i) sum += valves.opening(c, now + (i + 0.5) * 1e-3 / points) / points;
      ASSERT_NEAR(valves.mean_opening(c, now, next), sum, 1e-6);
      // No kink before the next one: the middle of the piece is the mean of its ends.
      const double end = std::min(next, valves.next_kink(now));
      ASSERT_NEAR(valves.opening(c, (now + end) / 2), (valves.opening(c, now) + valves.opening(c, end)) / 2, 1e-9);
    }
  }
}

TEST(TwinValves, JitterHasItsSigmaAndItsSeed) {
  const auto delays = [](std::uint64_t seed) {
    std::vector<double> all;
    ValveActuation valves(three_way(), {0.0, 0.0, 0.2e-3}, seed);
    for (int k = 0; k < 2000; ++k) {
      valves.command(k % 2 == 0 ? 1 : 0, 0.01 * k);
      if (k % 2 == 0) all.push_back(valves.next_kink(0.01 * k) - 0.01 * k);
    }
    return all;
  };
  const auto first = delays(1);
  EXPECT_EQ(first, delays(1));
  EXPECT_NE(first, delays(2));
  double mean = 0, square = 0;
  for (const double d : first) mean += d / static_cast<double>(first.size());
  for (const double d : first) square += (d - mean) * (d - mean) / static_cast<double>(first.size());
  EXPECT_NEAR(mean, 4e-3, 0.02e-3);
  EXPECT_NEAR(std::sqrt(square), 0.2e-3, 0.03e-3);
}

TEST(TwinSensing, WithoutNoiseOnlyFilterAndConverterRemain) {
  TwinParameters p = full_twin();
  TwinPlant plant(p, "three_way", 0.05, {false, false, 1});
  const double position_step = 0.12 / 8191, pressure_step = 420e3 / 8191;
  for (int k = 0; k < 300; ++k) {
    const Measurement s = plant.read(1e-3 * k);
    plant.write({static_cast<SwitchPattern>(k / 50 % 4), 0.0});
    EXPECT_LE(std::abs(s.value[position_channel] - s.truth[position]), position_step / 2 * 1.0001);
    const double level = (s.value[position_channel] + 0.01) / position_step;
    EXPECT_NEAR(level, std::round(level), 1e-6);
    const double pressure_level = (s.value[pressure_a_channel] - 101325.0 + 210e3) / pressure_step;
    EXPECT_NEAR(pressure_level, std::round(pressure_level), 1e-6);
    EXPECT_FALSE(s.ideal);
  }
}

TEST(TwinSensing, MeasuredPressuresAreTenMillisecondsOld) {
  TwinParameters p;
  SensingChain chain(p.sensing, 101325.0, false, {0, 0, 101325.0, 101325.0}, 1);
  const double slope = 1e6;  // Pa/s
  for (int i = 1; i <= 1500; ++i) chain.sample(101325.0 + slope * i * 1e-4, 101325.0);
  const Measurement s = chain.read(0.15, {});
  EXPECT_NEAR((101325.0 + slope * 0.15 - s.value[pressure_a_channel]) / slope, 0.0101, 1e-4);
  EXPECT_NEAR(s.value[pressure_b_channel], 101325.0, 26.0);
}

TEST(TwinSensing, NoiseIsThatOfTheThesisBeforeAndAfterItsFilters) {
  TwinParameters p;
  SensingChain chain(p.sensing, 101325.0, true, {0.05, 0, 150e3, 150e3}, 5);
  Butterworth2 butterworth(50.0, 1000.0);
  butterworth.reset(0.05);
  double raw_low = 1, raw_high = 0, low = 1, high = 0, pressure_low = 1e9, pressure_high = 0;
  for (int k = 0; k < 3000; ++k) {
    for (int i = 0; i < 10; ++i) chain.sample(150e3, 150e3);
    const Measurement s = chain.read(1e-3 * k, {0.05, 0, 150e3, 150e3});
    const double y = butterworth.step(s.value[position_channel]);
    raw_low = std::min(raw_low, s.value[position_channel]), raw_high = std::max(raw_high, s.value[position_channel]);
    low = std::min(low, y), high = std::max(high, y);
    pressure_low = std::min(pressure_low, s.value[pressure_a_channel]),
    pressure_high = std::max(pressure_high, s.value[pressure_a_channel]);
  }
  EXPECT_GT(raw_high - raw_low, 0.08e-3);  // "approximately 0.1 mm" over a plot; 3000 samples see the tails
  EXPECT_LT(raw_high - raw_low, 0.2e-3);
  EXPECT_GT(high - low, 0.02e-3);  // "to 0.05 mm"
  EXPECT_LT(high - low, 0.08e-3);
  EXPECT_LT(std::max(pressure_high - 150e3, 150e3 - pressure_low), 1000.0);  // "less than 1 kPa" from 10 kPa spikes
  EXPECT_GT(std::max(pressure_high - 150e3, 150e3 - pressure_low), 200.0);
}

TEST(TwinParameters, RefusesWhatItDoesNotKnowOrCannotBe) {
  const auto message = [](const std::string& text) -> std::string {
    try {
      twin_from(text);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(message("[gear]\nlaw = \"loose\""), HasSubstr("twin.toml:2: key 'gear.law'"));
  EXPECT_THAT(message("[valves]\ntravel = 1"), HasSubstr("not known"));
  EXPECT_THAT(message("[valves]\ntravel_fall_s = 0.003"), HasSubstr("twice deenergise_delay_s"));
  EXPECT_THAT(message("[flow]\ncritical_ratio = 0.9\nlaminar_from = 0.8"), HasSubstr("laminar_from"));
  EXPECT_THAT(message("[actuator]\nstatic_friction_n = 0.5"), HasSubstr("static_friction_n below"));
  EXPECT_THAT(message("[integration]\nsteps = 0"), HasSubstr("from 1 to 1000"));
  EXPECT_THAT(message("[friction]\nbristle_stiffness = -1"), HasSubstr("bristle_stiffness"));
  EXPECT_THAT(message("[sensing]\nposition_low_m = 0.2"), HasSubstr("position_high_m"));
  EXPECT_THAT(message("[motor]\nlag_s = 1e-5"), HasSubstr("shorter than a step"));
  EXPECT_THAT(message("[supply]\nvolume_m3 = 1e-5\nregulator_conductance = 1e-5"), HasSubstr("larger volume_m3"));
  EXPECT_THAT(message("speed = 3"), HasSubstr("not known"));
  EXPECT_EQ(message("[motor]\nlag_s = 0.001"), "accepted");
}

TEST(TwinParameters, MismatchPayloadAndPlaneReachTheTwin) {
  TwinCase task{Plane::horizontal, 0.15, {}};
  task.mismatch = {1.5, 0.9, 1.1, 1.25, 1.2};
  const TwinParameters p = full_twin(), q = twin_for(p, task);
  EXPECT_DOUBLE_EQ(q.actuator.coulomb_friction_n, 1.5 * p.actuator.coulomb_friction_n);
  EXPECT_DOUBLE_EQ(q.actuator.energise_delay_s, 1.25 * p.actuator.energise_delay_s);
  EXPECT_DOUBLE_EQ(q.valves.rise_s, 1.25 * p.valves.rise_s);
  EXPECT_DOUBLE_EQ(q.actuator.payload_mass_kg, 0.15);
  EXPECT_EQ(q.actuator.plane, Plane::horizontal);
  ActuatorParameters unloaded = q.actuator;
  unloaded.payload_mass_kg = 0.0;
  EXPECT_NEAR(unloaded.equivalent_mass_kg(), 1.2 * p.actuator.equivalent_mass_kg(), 1e-12);
  Mismatch flow;
  flow.flow = 0.9;
  const double fitted = TwinPhysics(p).orifices().fill.conductance();
  EXPECT_NEAR(TwinPhysics(twin_for(p, {Plane::vertical, 0.0, flow})).orifices().fill.conductance(), 0.9 * fitted,
              1e-12 * fitted);
}

}  // namespace
}  // namespace solenoid
