#include "controllers/systems/inverter/inverter_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/rig/emulated_node.hpp"
#include "experiments/rig/rig_file.hpp"
#include "experiments/rig/udp_io.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

std::string bytes_of(const NodePacket& p) {
  const auto b = p.encode();
  return {b.data(), b.size()};
}

TEST(NodePacket, HasTheBytesOfTheDocument) {
  NodePacket p;
  p.type = NodePacket::Type::command;
  p.session = 0x01020304;
  p.sequence = 0x0A0B0C0D;
  p.time_us = 0x1122334455667788;
  p.words = {9, -1'500'000};
  const std::string b = bytes_of(p);
  ASSERT_EQ(b.size(), 52u);
  EXPECT_EQ(b.substr(0, 4), "SLN1");
  EXPECT_EQ(b[4], 3);
  EXPECT_EQ(b.substr(8, 8), std::string("\x04\x03\x02\x01\x0D\x0C\x0B\x0A", 8));
  EXPECT_EQ(b.substr(16, 8), std::string("\x88\x77\x66\x55\x44\x33\x22\x11", 8));
  EXPECT_EQ(b.substr(24, 8), std::string("\x09\0\0\0\xA0\x1C\xE9\xFF", 8));
}

TEST(NodePacket, ComesBackWholeOrNotAtAll) {
  NodePacket p;
  p.type = NodePacket::Type::sample;
  p.words = {1, -2, 3, -4, 5, 6};
  const std::string good = bytes_of(p);
  const auto again = NodePacket::decode(good);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->words, p.words);
  for (std::size_t i = 0; i < good.size(); ++i)
    for (int bit = 0; bit < 8; ++bit) {
      std::string spoilt = good;
      spoilt[i] = static_cast<char>(spoilt[i] ^ (1 << bit));
      ASSERT_FALSE(NodePacket::decode(spoilt)) << i << " " << bit;
    }
  EXPECT_FALSE(NodePacket::decode(good.substr(1)));
  EXPECT_FALSE(NodePacket::decode(good + "x"));
  EXPECT_FALSE(NodePacket::decode(""));
}

TEST(NodePacket, SequencesGoRound) {
  EXPECT_TRUE(newer(1, 0));
  EXPECT_TRUE(newer(0, 0xFFFFFFFFu));
  EXPECT_FALSE(newer(0xFFFFFFFFu, 0));
  EXPECT_FALSE(newer(5, 5));
}

/// A plant that shows what it is told.
struct Mirror final : SimulatedPlant {
  Measurement read(double time_s) noexcept override { return {time_s, 0.02, 150e3, 120e3}; }
  void write(const Command& c) noexcept override { last = c; }
  double consumed() const override { return 0; }
  Command last;
};

VariantConfig with_valves(const std::string& valves) {
  VariantConfig variant = new_variant();
  variant.modes = valves;
  return variant;
}

struct NodeTest : testing::Test {
  EmulatedNode node{[](std::uint64_t) {
                      return std::make_unique<FaultyPlant>(std::make_unique<Mirror>(), std::vector<InjectedFault>{},
                                                           with_valves("two_way"), 1);
                    },
                    Calibration{}, 0xF};
  std::uint32_t sequence = 100, session = 7;

  NodePacket packet(NodePacket::Type type, std::int32_t coils = 0, std::int32_t motor_uv = 0) {
    NodePacket p;
    p.type = type;
    p.session = session;
    p.sequence = ++sequence;
    p.words = {coils, motor_uv};
    return p;
  }
  void open(double t) { ASSERT_TRUE(node.take(packet(NodePacket::Type::open), t)); }
};

TEST_F(NodeTest, AnswersARequestWithItsEchoInMicrovolts) {
  EXPECT_FALSE(node.take(packet(NodePacket::Type::request), 0.0));  // no session yet
  open(1.0);
  const auto answer = node.take(packet(NodePacket::Type::request), 1.001);
  ASSERT_TRUE(answer);
  EXPECT_EQ(static_cast<std::uint32_t>(answer->words[0]), sequence);
  EXPECT_EQ(answer->words[1], -2'500'000);  // 20 mm
  EXPECT_EQ(answer->words[2], static_cast<std::int32_t>(std::lround((150e3 - 101325) / 42e3 * 1e6)));
}

TEST_F(NodeTest, GoesSafeWithinTwentyMillisecondsOfTheLastCommandAndCountsIt) {
  open(0.0);
  node.take(packet(NodePacket::Type::command, 0b1001, 2'000'000), 0.010);
  EXPECT_EQ(node.outputs().switches, 0b1001u);
  EXPECT_NEAR(node.outputs().continuous[0], 3.2, 1e-9);
  node.take(packet(NodePacket::Type::request), 0.025);  // asking is no command
  node.tick(0.0294);
  EXPECT_EQ(node.outputs().switches, 0b1001u);
  node.tick(0.0296);
  EXPECT_EQ(node.outputs(), Command{});
  EXPECT_EQ(node.log().timeouts, 1);
  EXPECT_EQ(node.take(packet(NodePacket::Type::request), 0.040)->words[4], 1);
  node.take(packet(NodePacket::Type::command, 0b0110, 0), 0.050);
  EXPECT_EQ(node.outputs().switches, 0b0110u);
  node.take(packet(NodePacket::Type::safe), 0.051);
  EXPECT_EQ(node.outputs(), Command{});
}

TEST_F(NodeTest, IgnoresRepeatedOldAndForeignPackets) {
  open(0.0);
  const NodePacket first = packet(NodePacket::Type::command, 0b0001),
                   second = packet(NodePacket::Type::command, 0b0100);
  node.take(second, 0.001);
  node.take(first, 0.002);
  node.take(second, 0.003);
  EXPECT_EQ(node.outputs().switches, 0b0100u);
  session = 8;
  node.take(packet(NodePacket::Type::command, 0b1000), 0.004);
  EXPECT_EQ(node.outputs().switches, 0b0100u);
  EXPECT_EQ(node.log().old_packets, 3);
}

TEST_F(NodeTest, RefusesWhatItsOutputsCannotBe) {
  open(0.0);
  node.take(packet(NodePacket::Type::command, 0b0001), 0.001);
  node.take(packet(NodePacket::Type::command, 0x10), 0.002);
  node.take(packet(NodePacket::Type::command, 0, 5'100'000), 0.003);
  EXPECT_EQ(node.log().refused, 2);
  EXPECT_EQ(node.outputs().switches, 0b0001u);
  node.tick(0.022);  // and neither counted as a command
  EXPECT_EQ(node.log().timeouts, 1);
}

TEST(FaultScript, ReadsItsGrammarAndRefusesAllElse) {
  const InjectedFault f = parse_fault("pressure_a:slow=0.05@2+1.5", actuator_simulation());
  EXPECT_EQ(f.target, "pressure_a");
  EXPECT_EQ(f.kind, "slow");
  EXPECT_EQ(f.value, 0.05);
  EXPECT_TRUE(f.active(2.0) && f.active(3.4) && !f.active(3.5) && !f.active(1.9));
  EXPECT_TRUE(parse_fault("process:killed@1", actuator_simulation()).active(1e9));
  for (const char* bad :
       {"", "position", "position:off", "position:off@", "position:off@x", "position:off=3@1", "position:slow@1",
        "valves:off@1", "nothing:off@1", "position:slow=nan@1", "position:slow=-0.1@1", "packets:lost=-1@1"})
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
    RigInputs read() noexcept override { return {-2.5, 1.0, -1.0, fresh, false}; }
    void write(const RigOutputs& o) noexcept override { last = o; }
    void safe() noexcept override { last = {}; }
    IoHealth health() const noexcept override { return {}; }
    bool opened = false, fresh = true;
    RigOutputs last;
  };
  auto owned = std::make_unique<Wires>();
  Wires& wires = *owned;
  RigPlant plant(std::move(owned), {}, actuator_timing.tick_s);
  EXPECT_TRUE(wires.opened);
  Measurement s = plant.read(0.0);
  EXPECT_NEAR(s.value[position_channel], 0.02, 1e-12);
  EXPECT_NEAR(s.value[pressure_a_channel], 143325, 1e-9);
  EXPECT_EQ(s.stale_ticks, 0);
  plant.write({0b11, 8.0});
  EXPECT_NEAR(wires.last.motor_v, 5.0, 1e-12);
  plant.write({0, 99.0});
  EXPECT_NEAR(wires.last.motor_v, 5.0, 1e-12);
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
  EXPECT_EQ(rig.calibration.position.value(1.0), 0.06);
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
  for (const char* bad :
       {"[limits]\ndmpc_slots = 7", "[limits]\nmotor_n_per_tick = 1.0", "[limits]\ncontinuous_per_tick = 1.0",
        "[limits]\nposition_high_m = 0.1", "[limits]\ni_alpha_high = 1e6", "[comedi]\ndevice = '/dev/comedi0'"})
    EXPECT_THROW(read(bad), ConfigError) << bad;
}

TEST(NodeAddress, IsAnAddressAndAPort) {
  EXPECT_EQ(parse_node_address("10.0.0.2:99").port, 99);
  for (const char* bad : {"", "127.0.0.1:0", "127.0.0.1:70000", "host:1", "127.0.0.1:x"})
    EXPECT_THROW(parse_node_address(bad), ConfigError) << bad;
}

}  // namespace
}  // namespace solenoid
