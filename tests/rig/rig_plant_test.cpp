#include "controllers/systems/inverter/inverter_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/rig/fault_script.hpp"
#include "experiments/rig/faulty_plant.hpp"
#include "experiments/rig/rig_file.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/rig/rig_parts.hpp"

#include <filesystem>
#include <map>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using test::Mirror;
using test::with_valves;

TEST(FaultScript, ReadsItsGrammarAndRefusesAllElse) {
  const InjectedFault f = parse_fault("pressure_a:slow=0.05@2+1.5", actuator_simulation());
  EXPECT_EQ(f.target, "pressure_a");
  EXPECT_EQ(f.kind, "slow");
  EXPECT_EQ(f.value, 0.05);
  EXPECT_TRUE(f.active(2.0) && f.active(3.4) && !f.active(3.5) && !f.active(1.9));
  EXPECT_TRUE(parse_fault("process:killed@1", actuator_simulation()).active(1e9));
  for (const char* bad : {"",
                          "position",
                          "position:off",
                          "position:off@",
                          "position:off@x",
                          "position:off=3@1",
                          "position:slow@1",
                          "valves:off@1",
                          "nothing:off@1",
                          "position:slow=nan@1",
                          "position:slow=-0.1@1",
                          "packets:lost=-1@1",
                          "position:inverted=1@0",
                          "position:gain@0",
                          "position:gain=0@0",
                          "position:swapped@0",
                          "position:swapped=pressure_c@0",
                          "position:swapped=position@0",
                          "chamber_a:leaking@0",
                          "supply:factor@0",
                          "coils_c:swapped@0",
                          "motor:inverted=2@0"})
    EXPECT_THROW(parse_fault(bad, actuator_simulation()), ConfigError) << bad;
}

TEST(FaultyPlant, SpoilsWhatTheScriptSaysWhenItSays) {
  FaultyPlant plant(std::make_unique<Mirror>(),
                    parse_faults({"position:offset=0.005@1+1", "pressure_a:off@1", "valves:swapped@1", "supply:lost@2"},
                                 actuator_simulation()),
                    with_valves("two_way"), 1);
  EXPECT_EQ(plant.read(0.5).value[position_channel], 0.02);
  plant.write({0b0001, 1.0});
  EXPECT_EQ(plant.outputs().switches, 0b0001u);
  EXPECT_NEAR(plant.read(1.5).value[position_channel], 0.025, 1e-12);
  EXPECT_NEAR(plant.read(1.5).value[pressure_a_channel], 101325, 1e-6);
  plant.write({0b0001, 1.0});
  EXPECT_EQ(plant.outputs().switches, 0b0100u);
  EXPECT_EQ(plant.read(2.5).value[position_channel], 0.02);
  plant.write({0b0110, 1.0});  // swapped: exhaust B, fill A; without supply only exhaust B
  EXPECT_EQ(plant.outputs().switches, 0b1000u);
}

TEST(FaultyPlant, WiresSensorsWrongly) {
  // The middle of the position's converter is at 50 mm, that of the pressures at the atmosphere; the mirror shows 20 mm,
  // 150 kPa, 120 kPa.
  const auto read = [](const std::vector<std::string>& script) {
    FaultyPlant plant(std::make_unique<Mirror>(), parse_faults(script, actuator_simulation()), with_valves("two_way"),
                      1);
    return plant.read(0.5).value;
  };
  EXPECT_NEAR(read({"position:inverted@0"})[position_channel], 0.08, 1e-12);
  EXPECT_NEAR(read({"position:gain=0.9@0"})[position_channel], 0.05 - 0.9 * 0.03, 1e-12);
  EXPECT_NEAR(read({"pressure_a:inverted@0"})[pressure_a_channel], 2 * 101325.0 - 150e3, 1e-6);
  EXPECT_NEAR(read({"pressure_a:inverted@1"})[pressure_a_channel], 150e3, 1e-6);
  const ChannelValues swapped = read({"pressure_a:swapped=pressure_b@0"});
  EXPECT_NEAR(swapped[pressure_a_channel], 120e3, 1e-6);
  EXPECT_NEAR(swapped[pressure_b_channel], 150e3, 1e-6);
  // Volts are exchanged, whatever they stand for: a quarter of the position's range is a quarter of the pressure's.
  const ChannelValues crossed = read({"position:swapped=pressure_b@0"});
  EXPECT_NEAR(crossed[pressure_b_channel], 101325.0 - 210e3 + 0.25 * 420e3, 1e-6);
  EXPECT_NEAR(crossed[position_channel], -0.01 + (120e3 - 101325.0 + 210e3) / 420e3 * 0.12, 1e-9);
}

TEST(FaultyPlant, WiresOutputsWrongly) {
  const auto told = [](const char* script, const char* valves, const Command& command) {
    FaultyPlant plant(std::make_unique<Mirror>(), parse_faults({script}, actuator_simulation()), with_valves(valves),
                      1);
    plant.read(0.5);
    plant.write(command);
    return plant.outputs();
  };
  EXPECT_EQ(told("motor:inverted@0", "two_way", {0b0001, {3.0}}), (Command{0b0001, {-3.0}}));
  EXPECT_EQ(told("motor:lost@0", "two_way", {0b0001, {3.0}}), (Command{0b0001, {0.0}}));
  EXPECT_EQ(told("coils_a:swapped@0", "two_way", {0b1001, {}}).switches, 0b1010u);
  EXPECT_EQ(told("coils_b:swapped@0", "two_way", {0b1001, {}}).switches, 0b0101u);
  EXPECT_EQ(told("coils_b:swapped@0", "three_way", {0b01, {}}).switches, 0b11u);  // fills while it is off
  EXPECT_THROW(told("coils_a:swapped@0", "pcm_2", {}), ConfigError);
}

TEST(FaultyPlant, TellsThePlantOfFaultsThatNoCommandShows) {
  /// Notes what fails.
  struct Parts final : SimulatedPlant {
    Measurement read(double) noexcept override { return {}; }
    void write(const Command&) noexcept override {}
    void fail_part(std::string_view part, std::optional<double> value) noexcept override {
      of[std::string(part)] = value;
    }
    double consumed() const override { return 0.0; }
    std::map<std::string, std::optional<double>> of{};
  };
  auto parts = std::make_unique<Parts>();
  Parts& seen = *parts;
  FaultyPlant plant(std::move(parts),
                    parse_faults({"supply:factor=0.6@1+1", "chamber_b:leaking=0.02@1.5"}, actuator_simulation()),
                    with_valves("two_way"), 1);
  plant.read(0.9);
  EXPECT_TRUE(seen.of.empty());
  plant.read(1.6);
  EXPECT_EQ(seen.of.at("supply"), 0.6);
  EXPECT_EQ(seen.of.at("chamber_b"), 0.02);
  plant.read(2.0);
  EXPECT_EQ(seen.of.at("supply"), std::nullopt);
  EXPECT_EQ(seen.of.at("chamber_b"), 0.02);
  for (const char* script : {"supply:factor=0@1", "supply:factor=3@1", "chamber_a:leaking=1.5@1"})
    EXPECT_THROW(FaultyPlant(std::make_unique<Parts>(), parse_faults({script}, actuator_simulation()),
                             with_valves("two_way"), 1),
                 ConfigError)
        << script;
}

/// A chamber of each plant fills to the supply's pressure, of which there is less, and loses it through a leak.
TEST(FaultyPlant, SupplyAndLeaksActOnBothPlants) {
  for (const char* kind : {"twin", "model"}) {
    SCOPED_TRACE(kind);
    const Campaign campaign = read_campaign("rig", {{"nine_state"}, {"cycloidal"}});
    ScenarioConfig scenario = campaign.scenarios.front();
    actuator(scenario).plant = kind;
    const VariantConfig variant = told(campaign.variants.front(), scenario);
    const auto gauge = [&](const std::vector<std::string>& script, double shut_s) {
      FaultyPlant plant(make_plant(variant, scenario, 1), parse_faults(script, actuator_simulation()), variant, 1);
      double pressure = 0.0;
      for (int k = 0; k < 2000; ++k) {
        pressure = plant.read(1e-3 * k).truth[pressure_a];
        plant.write({static_cast<SwitchPattern>(1e-3 * k < 2.0 - shut_s ? 0b0101 : 0b0000), {}});
      }
      return pressure - 101325.0;
    };
    const double sound = gauge({}, 0.0), less = gauge({"supply:factor=0.6@0"}, 0.0);
    EXPECT_GT(sound, 145e3);
    EXPECT_LT(less, 110e3);  // above the 90 kPa of the supply by what the slide squeezes it
    EXPECT_GT(less, 80e3);
    const double tight = gauge({}, 0.5), leaking = gauge({"chamber_a:leaking=0.5@0"}, 0.5);
    EXPECT_GT(tight, 100e3);
    EXPECT_LT(leaking, 0.6 * tight);
  }
}

TEST(FaultyPlant, FailsTheCoilsThatTheScriptNames) {
  /// Notes what fails.
  struct Coils final : SimulatedPlant {
    Measurement read(double) noexcept override { return {}; }
    void write(const Command&) noexcept override {}
    void fail_switch(std::size_t c, const SwitchFault& fault) noexcept override { of[c] = fault; }
    double consumed() const override { return 0.0; }
    std::array<SwitchFault, max_switches> of{};
  };
  auto coils = std::make_unique<Coils>();
  const Coils& seen = *coils;
  FaultyPlant plant(std::move(coils),
                    parse_faults({"coil_supply_a_2:stuck_open@1+1", "coil_exhaust_b_1:leaking=0.25@1.5",
                                  "coil_supply_b_1:slow=0.01@1"},
                                 actuator_simulation()),
                    with_valves("pcm_2"), 1);
  plant.read(0.999);
  EXPECT_EQ(seen.of[1], SwitchFault{});
  plant.read(1.0);
  EXPECT_EQ(seen.of[1], (SwitchFault{SwitchFaultKind::stuck_on, 0.0}));
  EXPECT_EQ(seen.of[4], (SwitchFault{SwitchFaultKind::slow, 0.01}));
  EXPECT_EQ(seen.of[6], SwitchFault{});
  plant.read(2.0);
  EXPECT_EQ(seen.of[1], SwitchFault{});
  EXPECT_EQ(seen.of[6], (SwitchFault{SwitchFaultKind::leaking, 0.25}));
}

TEST(FaultyPlant, RefusesCoilsThatTheVariantHasNot) {
  const auto made = [](const char* script, const char* valves) {
    FaultyPlant(std::make_unique<Mirror>(), parse_faults({script}, actuator_simulation()), with_valves(valves), 1);
  };
  EXPECT_NO_THROW(made("coil_a:stuck_closed@1", "three_way"));
  for (const char* script : {"coil_supply_c:stuck_open@1", "coil_supply_a_1:stuck_open@1",
                             "coil_supply_a:leaking=1.5@1", "coil_supply_a:slow=0@1"})
    EXPECT_THROW(made(script, "two_way"), ConfigError) << script;
  try {
    made("coil_x:stuck_open@1", "two_way");
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("coil_supply_a, coil_exhaust_a, coil_supply_b, coil_exhaust_b"),
              std::string::npos)
        << error.what();
  }
}

TEST(FaultyPlant, DelaysByAsManyTicksAsTheScriptSays) {
  /// Shows the time in every channel.
  struct Clock final : SimulatedPlant {
    Measurement read(double time_s) noexcept override {
      Measurement m;
      m.time_s = time_s;
      m.value.fill(time_s);
      return m;
    }
    void write(const Command&) noexcept override {}
    double consumed() const override { return 0.0; }
  };
  const VariantConfig variant = with_valves("two_way");
  const auto faults = parse_faults({"position:delayed=1.5@2"}, actuator_simulation());
  FaultyPlant plant(std::make_unique<Clock>(), faults, variant, 1);
  for (int k = 0; k < 5000; ++k) {
    const double t = 0.001 * k, seen = plant.read(t).value[position_channel];
    EXPECT_NEAR(seen, k < 2000 ? t : t - 1.5, 1e-9) << k;
  }
  EXPECT_THROW(FaultyPlant(std::make_unique<Clock>(), parse_faults({"position:delayed=1e300@2"}, actuator_simulation()),
                           variant, 1),
               ConfigError);
}

TEST(Calibration, TurnsVoltsIntoQuantitiesAndBack) {
  struct Wires final : RigIo {
    void open() override { opened = true; }
    RigInputs read() noexcept override { return {{-2.5, 1.0, -1.0}, fresh, false}; }
    void write(const RigOutputs& o) noexcept override { last = o; }
    void safe() noexcept override { last = {}; }
    IoHealth health() const noexcept override { return {}; }
    bool opened = false, fresh = true;
    RigOutputs last;
  };
  auto owned = std::make_unique<Wires>();
  Wires& wires = *owned;
  const VariantConfig variant = with_valves("two_way");
  RigPlant plant(std::move(owned), usual_calibration(variant), variant);
  EXPECT_TRUE(wires.opened);
  Measurement s = plant.read(0.0);
  EXPECT_NEAR(s.value[position_channel], 0.02, 1e-12);
  EXPECT_NEAR(s.value[pressure_a_channel], 143325, 1e-9);
  EXPECT_EQ(s.stale_ticks, 0);
  plant.write({0b11, 8.0});
  EXPECT_NEAR(wires.last.volts[0], 5.0, 1e-12);
  plant.write({0, 99.0});
  EXPECT_NEAR(wires.last.volts[0], 5.0, 1e-12);
  wires.fresh = false;
  EXPECT_EQ(plant.read(0.001).stale_ticks, 1);
  EXPECT_EQ(plant.read(0.004).stale_ticks, 4);  // ticks that were skipped count
  wires.fresh = true;
  EXPECT_EQ(plant.read(0.005).stale_ticks, 0);
}

TEST(RigFile, ReadsWiringAndRefusesWhatCannotBe) {
  const test::Folder folder;
  const auto read = [&](const std::string& text) {
    std::ofstream(folder / "rig.toml") << text;
    return read_rig_file((folder / "rig.toml").string(), new_variant());
  };
  const RigFile rig = read(
      "[calibration]\nposition = { offset = 0.04, gain = 0.02 }\n[comedi]\ndevice = '/dev/comedi1'\n"
      "valves = { subdevice = 2, coils = [4, 5], watchdog = 7 }\n[limits]\nposition_high_m = 0.09\n");
  EXPECT_EQ(rig.calibration.channels[position_channel].value(1.0), 0.06);
  EXPECT_EQ(rig.comedi.device, "/dev/comedi1");
  EXPECT_EQ(rig.comedi.watchdog_channel, 7);
  EXPECT_EQ(rig.ladder.limits[position_channel].high, 0.09);
  for (const char* bad : {"[calibration]\nposition = { gain = 0.0 }", "[comedi]\nvalves = { coils = [1, 1] }",
                          "[comedi]\nvalves = { coils = [1], watchdog = 1 }", "[limits]\nposition_high_m = -0.009",
                          "[comedi]\nnonsense = 1", "nonsense = 1"})
    EXPECT_THROW(read(bad), ConfigError) << bad;
}

TEST(RigFile, LimitsOfAnotherSystemHaveItsWordsAndFollowTheVariant) {
  VariantConfig variant = new_variant(find_system("inverter"));
  const ChannelLimits usual = usual_rig(variant).ladder.limits[0];
  const double slew = usual_rig(variant).ladder.plausibility.channels[0].slew_per_tick;
  inverter(variant).nominal.rated_current_a /= 10;
  inverter(variant).nominal.inductance_h *= 100;
  EXPECT_NEAR(usual_rig(variant).ladder.limits[0].high, usual.high / 10, 1e-9);
  EXPECT_LT(usual_rig(variant).ladder.plausibility.channels[0].slew_per_tick, slew);
  const auto read = [&](const std::string& text) {
    return read_rig(TableReader::from_text(text, "rig.toml"), variant);
  };
  const RigFile rig = read("[limits]\ni_alpha_high = 70.0\nheld_slots = 7\nswitch_period_ticks = 2\n");
  EXPECT_EQ(rig.ladder.limits[0].high, 70.0);
  EXPECT_EQ(rig.ladder.held_slots, 7);
  EXPECT_EQ(rig.rates.switch_period_ticks, 2);
  const RigFile wired = read("[comedi]\nlevels = { gates = [2, 3, 4, 5, 6, 7], watchdog = 0 }\n");
  EXPECT_EQ(wired.comedi.switch_channels.front(), 2);
  for (const char* bad :
       {"[limits]\ndmpc_slots = 7", "[limits]\nmotor_n_per_tick = 1.0", "[limits]\ncontinuous_per_tick = 1.0",
        "[limits]\nposition_high_m = 0.1", "[limits]\ni_alpha_high = 1e6", "[comedi]\nvalves = { coils = [0, 1] }",
        "[calibration]\nposition = { gain = 1.0 }", "[comedi]\nlevels = { gates = [0, 1] }", "[node]\naddress = 5"})
    EXPECT_THROW(read(bad), ConfigError) << bad;
}

}  // namespace
}  // namespace solenoid
