#include "controllers/systems/inverter/inverter_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/rig/emulator.hpp"
#include "experiments/rig/rig_file.hpp"
#include "experiments/rig/udp_io.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cmath>
#include <filesystem>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sodium/crypto_shorthash_siphash24.h>

namespace solenoid {
namespace {

VariantConfig with_valves(const std::string& valves) {
  VariantConfig variant = new_variant();
  variant.modes = valves;
  return variant;
}

constexpr NodeKey key_of(unsigned char first) {
  NodeKey key;
  for (unsigned char& byte : key.bytes) byte = first++;
  return key;
}
const NodeKey secret = key_of(0), another = key_of(1);

std::string bytes_of(const NodePacket& p, const NodeKey* key = nullptr) {
  std::array<char, NodePacket::most_size> room;
  return {room.data(), p.encode(room, key)};
}

NodePacket some_command() {
  NodePacket p(NodePacket::Type::command);
  p.session = 0x0102030405060708;
  p.sequence = 0x1A2A3A4A5A6A7A8A;
  p.time_us = 0x1122334455667788;
  NodeCommand{9, {-1.5}, 0x0A0B0C0D0E0F0102}.put(p, 1);
  return p;
}

TEST(NodePacket, HasTheBytesOfTheDocument) {
  const std::string b = bytes_of(some_command());
  ASSERT_EQ(b.size(), 32u + 16u + 16u);
  EXPECT_EQ(b.substr(0, 4), "SLN2");
  EXPECT_EQ(b.substr(4, 4), std::string("\x06\0\x10\0", 4));  // command, no flags, 16 bytes
  EXPECT_EQ(b.substr(8, 8), "\x08\x07\x06\x05\x04\x03\x02\x01");
  EXPECT_EQ(b.substr(16, 8), "\x8A\x7A\x6A\x5A\x4A\x3A\x2A\x1A");
  EXPECT_EQ(b.substr(24, 8), "\x88\x77\x66\x55\x44\x33\x22\x11");
  EXPECT_EQ(b.substr(32, 8), std::string("\x09\0\0\0\xA0\x1C\xE9\xFF", 8));
  EXPECT_EQ(b.substr(40, 8), "\x02\x01\x0F\x0E\x0D\x0C\x0B\x0A");
  EXPECT_EQ(b.substr(52), std::string(12, '\0'));  // after the CRC
}

/// The key and, of its 64 messages of bytes 0, 1, 2, ..., those of the SipHash authors' vectors for 128 bits
/// (github.com/veorq/SipHash, vectors.h, vectors_sip128) that are at hand here: so the tag is that hash and no other.
TEST(NodePacket, TagIsSipHash24Of128Bits) {
  std::array<unsigned char, 16> tag;
  const std::array<unsigned char, 2> message = {0, 1};
  const auto hex = [&](std::size_t size) {
    crypto_shorthash_siphashx24(tag.data(), message.data(), size, secret.bytes.data());
    std::string text;
    for (const unsigned char byte : tag) text += fmt::format("{:02x}", byte);
    return text;
  };
  EXPECT_EQ(hex(0), "a3817f04ba25a8e66df67214c7550293");
  EXPECT_EQ(hex(1), "da87c1d86b99af44347659119b22fc45");
  const std::string b = bytes_of(some_command(), &secret);
  crypto_shorthash_siphashx24(tag.data(), reinterpret_cast<const unsigned char*>(b.data()), 48, secret.bytes.data());
  EXPECT_EQ(b.substr(48), std::string(reinterpret_cast<const char*>(tag.data()), tag.size()));
}

TEST(NodePacket, ComesBackWholeOrNotAtAll) {
  for (const NodeKey* key : {static_cast<const NodeKey*>(nullptr), &secret}) {
    const std::string good = bytes_of(some_command(), key);
    const auto again = NodePacket::decode(good, key);
    ASSERT_TRUE(again);
    EXPECT_EQ(bytes_of(*again, key), good);
    for (std::size_t i = 0; i < good.size(); ++i)
      for (int bit = 0; bit < 8; ++bit) {
        std::string spoilt = good;
        spoilt[i] = static_cast<char>(spoilt[i] ^ (1 << bit));
        ASSERT_FALSE(NodePacket::decode(spoilt, key)) << i << " " << bit;
      }
    for (std::size_t size = 0; size < good.size(); ++size) ASSERT_FALSE(NodePacket::decode(good.substr(0, size), key));
    EXPECT_FALSE(NodePacket::decode(good + "x", key));
    EXPECT_FALSE(NodePacket::decode(good, &another));
    EXPECT_FALSE(NodePacket::decode(good, key ? nullptr : &secret));
  }
}

TEST(NodePacket, LeavesOutWhatHasNoRoomAndReadsNothingBeyondItsEnd) {
  NodePacket p(NodePacket::Type::hello);
  p.append(std::string(2000, 'x'));
  EXPECT_EQ(p.length, NodePacket::most_payload);
  p.append(std::int32_t{1});
  EXPECT_EQ(p.length, NodePacket::most_payload);
  EXPECT_EQ(bytes_of(p).size(), NodePacket::most_size);
  EXPECT_EQ(p.word(NodePacket::most_payload - 3), 0);
  EXPECT_EQ(p.text(NodePacket::most_payload), "");
  EXPECT_FALSE(NodeSample::of(p, 3));
  EXPECT_FALSE(NodeCommand::of(p, 1));
}

TEST(NodeKey, IsAFileOfDigitsThatNobodyElseMayRead) {
  const test::Folder folder;
  const auto written = [&](const std::string& text, std::filesystem::perms others = {}) {
    std::string file = folder.write("key", text);
    std::filesystem::permissions(file, std::filesystem::perms::owner_all | others);
    return file;
  };
  EXPECT_EQ(read_node_key(written("000102030405060708090a0b0c0d0e0f\n")).bytes, secret.bytes);
  for (const char* bad : {"", "00", "000102030405060708090a0b0c0d0e0g", "000102030405060708090a0b0c0d0e0f00",
                          "000102030405060708090a0b0c0d0e0f 000102030405060708090a0b0c0d0e0f"})
    EXPECT_THROW(read_node_key(written(bad)), ConfigError) << bad;
  EXPECT_THROW(read_node_key(written("000102030405060708090a0b0c0d0e0f", std::filesystem::perms::group_read)),
               ConfigError);
  EXPECT_THROW(read_node_key(folder.file("none")), ConfigError);
  EXPECT_THROW(read_node_key(folder.path()), ConfigError);
}

/// A plant that shows what it is told.
struct Mirror final : SimulatedPlant {
  Measurement read(double time_s) noexcept override { return {time_s, 0.02, 150e3, 120e3}; }
  void write(const Command& c) noexcept override { last = c; }
  double consumed() const override { return 0; }
  Command last;
};

constexpr NodePeer operator_at{0x7F000001, 50000}, stranger{0x7F000001, 50001};

struct NodeTest : testing::Test {
  using Type = NodePacket::Type;
  VariantConfig variant = with_valves("two_way");
  std::string wire = wire_text(system_of(variant).description(), system_of(variant).modes(variant));
  EmulatedNode node{std::make_unique<FaultyPlant>(std::make_unique<Mirror>(), std::vector<InjectedFault>{}, variant, 1),
                    usual_calibration(variant), system_of(variant).modes(variant), wire};
  std::uint64_t sequence = 100, session = 0, seen_us = 0;

  NodePacket packet(Type type) {
    NodePacket p(type);
    p.session = session;
    p.sequence = ++sequence;
    return p;
  }
  NodePacket command(std::uint32_t coils, double motor_v = 0.0) {
    NodePacket p = packet(Type::command);
    NodeCommand{coils, {motor_v}, seen_us}.put(p, 1);
    return p;
  }
  NodePacket hello(std::uint64_t number) {
    NodePacket p = packet(Type::hello);
    p.session = number;
    p.append(std::string_view(wire));
    return p;
  }
  std::optional<NodePacket> take(const NodePacket& p, double t, const NodePeer& from = operator_at) {
    return node.take(p, from, t);
  }
  void open(double t, const NodePeer& from = operator_at) {
    const auto offer = take(hello(11), t, from);
    ASSERT_TRUE(offer && offer->type == Type::offer && offer->number(0) == 11);
    session = offer->session;
    const auto first = take(packet(Type::open), t, from);
    ASSERT_TRUE(first && first->type == Type::sample);
    seen_us = first->time_us;
  }
  NodeSample asked(double t) {
    const auto sample = take(packet(Type::request), t);
    seen_us = sample->time_us;
    return *NodeSample::of(*sample, 3);
  }
};

TEST_F(NodeTest, AnswersARequestWithItsEchoAndTheChannelsInMicrovolts) {
  open(1.0);
  const NodeSample sample = asked(1.001);
  EXPECT_EQ(sample.echo, sequence);
  EXPECT_NEAR(sample.volts[0], -2.5, 1e-6);  // 20 mm
  EXPECT_NEAR(sample.volts[1], (150e3 - 101325) / 42e3, 1e-6);
}

TEST_F(NodeTest, GoesSafeWithinTwentyMillisecondsOfTheLastCommandAndCountsIt) {
  open(0.0);
  take(command(0b1001, 2.0), 0.010);
  EXPECT_EQ(node.outputs().switches, 0b1001u);
  EXPECT_NEAR(node.outputs().continuous[0], 3.2, 1e-9);
  asked(0.025);  // asking is no command
  node.tick(0.0289);
  EXPECT_EQ(node.outputs().switches, 0b1001u);
  node.tick(0.0291);
  EXPECT_EQ(node.outputs(), Command{});
  EXPECT_EQ(node.log().timeouts, 1);
  EXPECT_EQ(asked(0.040).timeouts, 1);
  take(command(0b0110), 0.050);
  EXPECT_EQ(node.outputs().switches, 0b0110u);
  take(packet(Type::safe), 0.051);
  EXPECT_EQ(node.outputs(), Command{});
}

/// The same packet of a stranger's without end, or for two seconds: a loop that never ends shows as one that is late.
class Flood final : public NodePort {
 public:
  Flood(double every_s, std::string bytes) : every_s_(every_s), bytes_(std::move(bytes)) {}
  double now_s() override { return now_s_; }
  std::optional<std::string_view> receive(NodePeer& from) override {
    if (now_s_ > 2.0) return std::nullopt;
    now_s_ += every_s_;
    from = stranger;
    return bytes_;
  }
  void send(std::string_view, const NodePeer&) override {}
  void wait(double seconds) override { now_s_ += seconds; }

 private:
  double every_s_, now_s_ = 0.0;
  std::string bytes_;
};

/// A flood's packets are valid, or none; each takes so long on a slow machine.
struct NodeUnderFlood : NodeTest {
  void safe_in_time(double every_s, const std::string& bytes) {
    open(0.0);
    take(command(0b0101, 1.0), 0.0);
    ASSERT_EQ(node.outputs().switches, 0b0101u);
    Flood port(every_s, bytes);
    serve(node, {}, port, [&] { return port.now_s() > 0.5; });
    EXPECT_EQ(node.outputs(), Command{});
    EXPECT_EQ(node.log().timeouts, 1);
    EXPECT_GE(node.log().safe_after_s, node_timeout_s);
    EXPECT_LE(node.log().safe_after_s, 0.020);
  }
};

TEST_F(NodeUnderFlood, LooksForATimeoutBeforeEachPacket) {
  std::array<char, NodePacket::most_size> room;
  const std::size_t size = hello(12).encode(room, nullptr);
  safe_in_time(0.9e-3, {room.data(), size});
}

TEST_F(NodeUnderFlood, LooksAwayFromWhatIsNoPacketInTime) { safe_in_time(25e-6, std::string(200, 'x')); }

TEST_F(NodeTest, NoTimeoutBeforeTheFirstCommandOfASession) {
  open(0.0);
  for (int k = 1; k < 500; ++k) {
    node.tick(1e-3 * k);
    if (k % 100 == 0) asked(1e-3 * k);
  }
  EXPECT_EQ(node.log().timeouts, 0);
  EXPECT_EQ(node.log().safe_after_s, 0.0);
}

TEST_F(NodeTest, IgnoresRepeatedOldAndForeignPackets) {
  open(0.0);
  const NodePacket first = command(0b0001), second = command(0b0100);
  take(second, 0.001);
  take(first, 0.002);
  take(second, 0.003);
  EXPECT_EQ(node.outputs().switches, 0b0100u);
  EXPECT_EQ(node.log().old_packets, 2);
  session ^= 1;
  take(command(0b1000), 0.004);
  EXPECT_EQ(node.outputs().switches, 0b0100u);
  EXPECT_EQ(node.log().foreign_packets, 1);
}

TEST_F(NodeTest, RefusesWhatItsOutputsCannotBe) {
  open(0.0);
  take(command(0b0001), 0.001);
  take(command(0x10), 0.002);
  take(command(0, 5.1), 0.003);
  take(command(0, std::nan("")), 0.004);
  NodePacket cut = packet(Type::command);
  cut.append(std::int32_t{0});
  take(cut, 0.005);
  EXPECT_EQ(node.log().refused, 4);
  EXPECT_EQ(node.outputs().switches, 0b0001u);
  node.tick(0.022);  // and none counted as a command
  EXPECT_EQ(node.log().timeouts, 1);
}

TEST_F(NodeTest, BelongsToWhoOpenedItUntilNothingIsHeard) {
  open(0.0);
  take(command(0b0001), 0.001);
  const std::uint64_t of_operator = session, at = sequence;
  const auto refused = take(hello(12), 0.002, stranger);
  ASSERT_TRUE(refused && refused->type == Type::refuse);
  EXPECT_EQ(refused->session, 12u);
  EXPECT_EQ(static_cast<NodeRefusal>(refused->word(0)), NodeRefusal::busy);
  EXPECT_THAT(std::string(refused->text(4)), testing::HasSubstr("127.0.0.1:50000"));
  EXPECT_EQ(asked(0.003).asked, 1);  // and the operator is told
  // Whatever the stranger sends with the operator's session, and however far ahead, moves nothing.
  for (const Type type : {Type::open, Type::safe, Type::close, Type::command}) {
    NodePacket forged = packet(type);
    forged.session = of_operator;
    forged.sequence = at + 100'000;
    if (type == Type::command) NodeCommand{0b0101, {5.0}, seen_us}.put(forged, 1);
    take(forged, 0.004, stranger);
    EXPECT_EQ(node.outputs().switches, 0b0001u);
  }
  take(command(0b0100), 0.005);
  EXPECT_EQ(node.outputs().switches, 0b0100u);
  // Silent for node_hold_s: the next who asks has it, from safe outputs.
  node.tick(1.1);
  open(1.1, stranger);
  EXPECT_EQ(node.outputs(), Command{});
  EXPECT_EQ(node.log().sessions, 2);
  session = of_operator;
  sequence += 1000;
  take(command(0b1000), 1.2);
  EXPECT_EQ(node.outputs(), Command{});
  const auto lost = take(packet(Type::request), 1.2);
  ASSERT_TRUE(lost && lost->type == Type::refuse);  // the first controller learns that the node is another's
}

TEST_F(NodeTest, AnOpenOfTheRunningSessionLowersNoSequence) {
  const auto offer = take(hello(11), 0.0);
  session = offer->session;
  const NodePacket first_open = packet(Type::open);
  ASSERT_TRUE(take(first_open, 0.0));
  const NodePacket old = command(0b0101);
  take(command(0b0001), 0.001);
  take(first_open, 0.002);  // on the network again
  NodePacket rebuilt = first_open;
  rebuilt.sequence = 0;
  take(rebuilt, 0.003);
  take(old, 0.004);
  EXPECT_EQ(node.outputs().switches, 0b0001u);
  EXPECT_EQ(node.log().old_packets, 3);
  EXPECT_EQ(node.log().sessions, 1);
}

TEST_F(NodeTest, ARecordedSessionCannotBePlayedAgain) {
  const NodePacket recorded_hello = hello(11);
  session = take(recorded_hello, 0.0)->session;
  const std::vector<NodePacket> recorded = {packet(Type::open), command(0b0101), command(0b1010)};
  for (const NodePacket& p : recorded) take(p, 0.001);
  take(packet(Type::close), 0.002);
  ASSERT_EQ(node.outputs(), Command{});
  EXPECT_NE(take(recorded_hello, 0.01)->session, session);
  for (const NodePacket& p : recorded) take(p, 0.01);
  EXPECT_EQ(node.outputs(), Command{});
  EXPECT_EQ(node.log().sessions, 1);
}

TEST_F(NodeTest, CommandsThatWereHeldBackMoveNothing) {
  open(0.0);
  asked(0.001);
  take(command(0b0001), 0.001);
  const NodePacket before_the_timeout = command(0b0101);
  node.tick(0.030);
  ASSERT_EQ(node.log().timeouts, 1);
  take(before_the_timeout, 0.031);  // newer than all that came, and 30 ms old
  EXPECT_EQ(node.outputs(), Command{});
  asked(0.032);
  take(command(0b0010), 0.032);
  EXPECT_EQ(node.outputs().switches, 0b0010u);
  // Two dozen held for a quarter of a minute while the controller lived on, which it no longer does.
  std::vector<NodePacket> held;
  held.reserve(24);
  for (int k = 0; k < 24; ++k) held.push_back(command(0b1010));
  double t = 15.0;
  for (const NodePacket& p : held) {
    take(p, t += 1e-3);
    EXPECT_EQ(node.outputs(), Command{});
  }
  EXPECT_EQ(node.log().old_packets, 25);
}

TEST_F(NodeTest, ASteadyStreamOfOldCommandsIsNone) {
  open(0.0);
  double stopped = 0.0;
  for (int k = 0; k < 300; ++k) {  // each is sent at once but for a sample from before 5 ms, then 1 ms later each time
    const double now = 1e-3 * k;
    if (k == 5) asked(now);
    take(command(0b0001), now);
    if (stopped == 0.0 && k > 5 && node.outputs().switches == 0) stopped = now;
  }
  EXPECT_NEAR(stopped, 0.005 + node_command_age_s + node_timeout_s, 2e-3);
}

TEST_F(NodeTest, ACommandThatIsLateEndsNoTimeoutThatNobodyLookedFor) {
  open(0.0);
  take(command(0b0001), 0.001);
  take(command(0b0100), 0.026);  // no tick between: the node was kept from it
  EXPECT_EQ(node.outputs(), Command{});
  EXPECT_EQ(node.log().timeouts, 1);
  EXPECT_EQ(asked(0.027).timeouts, 1);
}

TEST_F(NodeTest, AnswersAStrangerWithAtMostThreeTimesWhatItSent) {
  for (std::size_t size = 0; size < 40; ++size) {
    NodePacket p = packet(Type::hello);
    p.append(std::string(size, 'x'));
    const auto answer = take(p, 0.0, stranger);
    ASSERT_TRUE(answer && answer->type == Type::refuse);
    EXPECT_LE(bytes_of(*answer).size(), 3 * bytes_of(p).size());
  }
}

TEST_F(NodeTest, StrangersDoNotFillTheListOfEvents) {
  open(0.0);
  take(command(0b0001), 0.001);
  for (int k = 0; k < 3000; ++k) take(hello(12), 0.002, {0x7F000001, static_cast<std::uint16_t>(50001 + k % 2)});
  node.tick(0.030);
  EXPECT_EQ(node.log().events.back().what, "safe by timeout");
  EXPECT_LT(node.log().events.size(), 200u);
}

TEST_F(NodeTest, ItsOwnPacketsSentBackMoveNothing) {
  open(0.0);
  NodePacket reflected = *take(packet(Type::request), 0.001);
  reflected.sequence = sequence + 1000;
  take(reflected, 0.002);
  take(command(0b0001), 0.003);  // is still newer than the newest
  EXPECT_EQ(node.outputs().switches, 0b0001u);
}

TEST_F(NodeTest, AnotherWireIsRefusedByName) {
  NodePacket p = packet(Type::hello);
  p.session = 5;
  p.append(std::string_view("thrusters; channels: x [m]"));
  const auto answer = take(p, 0.0);
  ASSERT_TRUE(answer && answer->type == Type::refuse);
  EXPECT_EQ(static_cast<NodeRefusal>(answer->word(0)), NodeRefusal::other_wire);
  EXPECT_EQ(answer->text(4), wire);
  EXPECT_FALSE(node.begun());
}

TEST_F(NodeTest, ThePlantStaysWhereASessionLeftIt) {
  VariantConfig real = with_valves("two_way");
  const Campaign campaign = read_campaign("rig", {{"nine_state"}, {"cycloidal"}});
  EmulatedNode twin{std::make_unique<FaultyPlant>(make_plant(campaign.variants.front(), campaign.scenarios.front(), 1),
                                                  std::vector<InjectedFault>{}, campaign.variants.front(), 1),
                    usual_calibration(real), system_of(real).modes(real), wire};
  const auto begin = [&](double t, const NodePeer& from) {
    const auto offer = twin.take(hello(11), from, t);
    session = offer->session;
    const auto first = twin.take(packet(Type::open), from, t);
    seen_us = first->time_us;
    return NodeSample::of(*first, 3)->volts;
  };
  const double at_first = begin(0.0, operator_at)[0];
  double t = 0.0;
  for (int k = 0; k < 600; ++k) {
    seen_us = twin.take(packet(Type::request), operator_at, t += 1e-3)->time_us;
    twin.take(command(0b1001, 5.0), operator_at, t);
  }
  const double moved = NodeSample::of(*twin.take(packet(Type::request), operator_at, t), 3)->volts[0];
  ASSERT_GT(moved, at_first + 1.0);
  twin.take(packet(Type::close), operator_at, t);
  EXPECT_NEAR(begin(t + 0.001, stranger)[0], moved, 0.2);
}

TEST(WireText, NamesEverySignalAndSwitchOfEverySystem) {
  for (const auto& system : systems()) {
    const VariantConfig variant = new_variant(system);
    const ModeSet modes = system->modes(variant);
    const std::string text = wire_text(system->description(), modes);
    for (const Signal& signal : system->description().channels)
      EXPECT_THAT(text, testing::HasSubstr(signal.name + " [" + signal.unit + "]"));
    for (const Switch& s : modes.switches()) EXPECT_THAT(text, testing::HasSubstr(" " + s.name));
    EXPECT_LT(text.size() + 4, NodePacket::most_payload);
  }
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

TEST(NodeAddress, IsAnAddressAndAPort) {
  EXPECT_EQ(parse_node_address("10.0.0.2:99").port, 99);
  for (const char* bad : {"", ":", "127.0.0.1", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:70000", "host:1", "127.0.0.1:x",
                          "127.0.0.1:47811x", "127.0.0.1: 47811", "127.0.0.1:+1", "127.0.0.1:99999999999"})
    EXPECT_THROW(parse_node_address(bad), ConfigError) << bad;
}

}  // namespace
}  // namespace solenoid
