#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/rig/emulator.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "tests/rig/rig_parts.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using test::bytes_of;
using test::Mirror;
using test::with_valves;

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
    NodeCommand{coils, {to_microvolts(motor_v)}, seen_us}.put(p, 1);
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
  /// The begin of the session that was offered to who asked with 11, as hello(11) does.
  NodePacket opening() {
    NodePacket p = packet(Type::open);
    p.append(std::uint64_t{11});
    return p;
  }
  void open(double t, const NodePeer& from = operator_at) {
    const auto offer = take(hello(11), t, from);
    ASSERT_TRUE(offer && offer->type == Type::offer && offer->number(0) == 11);
    session = offer->session;
    const auto first = take(opening(), t, from);
    ASSERT_TRUE(first && first->type == Type::sample);
    seen_us = first->time_us;
  }
  NodePacket request() {
    NodePacket p = packet(Type::request);
    p.append(seen_us);
    return p;
  }
  NodeSample asked(double t) {
    const auto sample = take(request(), t);
    seen_us = sample->time_us;
    return *NodeSample::of(*sample, 3);
  }
};

TEST_F(NodeTest, AnswersARequestWithItsEchoAndTheChannelsInMicrovolts) {
  open(1.0);
  const NodeSample sample = asked(1.001);
  EXPECT_EQ(sample.echo, sequence);
  EXPECT_NEAR(from_microvolts(sample.microvolts[0]), -2.5, 1e-6);  // 20 mm
  EXPECT_NEAR(from_microvolts(sample.microvolts[1]), (150e3 - 101325) / 42e3, 1e-6);
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
  EXPECT_EQ(node.log().counters.timeouts, 1);
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
    EXPECT_EQ(node.log().counters.timeouts, 1);
    EXPECT_GE(node.log().safe_after_s, node_timeout_s);
    EXPECT_LE(node.log().safe_after_s, 0.020);
  }
};

TEST_F(NodeUnderFlood, LooksForATimeoutBeforeEachPacket) { safe_in_time(0.9e-3, bytes_of(hello(12))); }

TEST_F(NodeUnderFlood, LooksAwayFromWhatIsNoPacketInTime) { safe_in_time(25e-6, std::string(200, 'x')); }

TEST_F(NodeTest, NoTimeoutBeforeTheFirstCommandOfASession) {
  open(0.0);
  for (int k = 1; k < 500; ++k) {
    node.tick(1e-3 * k);
    if (k % 100 == 0) asked(1e-3 * k);
  }
  EXPECT_EQ(node.log().counters.timeouts, 0);
  EXPECT_EQ(node.log().safe_after_s, 0.0);
}

TEST_F(NodeTest, IgnoresRepeatedOldAndForeignPackets) {
  open(0.0);
  const NodePacket first = command(0b0001), second = command(0b0100);
  take(second, 0.001);
  take(first, 0.002);
  take(second, 0.003);
  EXPECT_EQ(node.outputs().switches, 0b0100u);
  EXPECT_EQ(node.log().counters.old_packets, 2);
  session ^= 1;
  take(command(0b1000), 0.004);
  EXPECT_EQ(node.outputs().switches, 0b0100u);
  EXPECT_EQ(node.log().counters.foreign_packets, 1);
}

/// On a wire that jitters the command of a tick overtakes its request: that one is answered, but once, and changes
/// nothing.
TEST_F(NodeTest, ARequestThatACommandOvertookIsAnsweredOnce) {
  open(0.0);
  const NodePacket first = request(), newer = request();
  take(command(0b0001), 0.001);
  const auto sample = take(first, 0.002);
  ASSERT_TRUE(sample && sample->type == Type::sample);
  EXPECT_EQ(NodeSample::of(*sample, 3)->echo, first.sequence);
  EXPECT_FALSE(take(first, 0.003));
  EXPECT_TRUE(take(newer, 0.003));
  EXPECT_FALSE(take(first, 0.004));
  EXPECT_EQ(node.log().counters.old_packets, 2);
  EXPECT_EQ(node.outputs().switches, 0b0001u);
  const NodePacket old = command(0b0100);
  take(request(), 0.005);
  take(old, 0.006);  // nor does a request make a command old
  EXPECT_EQ(node.outputs().switches, 0b0100u);
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
  EXPECT_EQ(node.log().counters.refused, 4);
  EXPECT_EQ(node.outputs().switches, 0b0001u);
  node.tick(0.022);  // and none counted as a command
  EXPECT_EQ(node.log().counters.timeouts, 1);
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
    if (type == Type::command) NodeCommand{0b0101, {5'000'000}, seen_us}.put(forged, 1);
    take(forged, 0.004, stranger);
    EXPECT_EQ(node.outputs().switches, 0b0001u);
  }
  take(command(0b0100), 0.005);
  EXPECT_EQ(node.outputs().switches, 0b0100u);
  // Silent for node_hold_s: the next who asks has it, from safe outputs.
  node.tick(1.1);
  open(1.1, stranger);
  EXPECT_EQ(node.outputs(), Command{});
  EXPECT_EQ(node.log().counters.sessions, 2);
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
  const NodePacket first_open = opening();
  ASSERT_TRUE(take(first_open, 0.0));
  const NodePacket old = command(0b0101);
  take(command(0b0001), 0.001);
  take(first_open, 0.002);  // on the network again
  NodePacket rebuilt = first_open;
  rebuilt.sequence = 0;
  take(rebuilt, 0.003);
  take(old, 0.004);
  EXPECT_EQ(node.outputs().switches, 0b0001u);
  EXPECT_EQ(node.log().counters.old_packets, 3);
  EXPECT_EQ(node.log().counters.sessions, 1);
}

TEST_F(NodeTest, ARecordedSessionCannotBePlayedAgain) {
  const NodePacket recorded_hello = hello(11);
  session = take(recorded_hello, 0.0)->session;
  const std::vector<NodePacket> recorded = {opening(), command(0b0101), command(0b1010)};
  for (const NodePacket& p : recorded) take(p, 0.001);
  take(packet(Type::close), 0.002);
  ASSERT_EQ(node.outputs(), Command{});
  EXPECT_NE(take(recorded_hello, 0.01)->session, session);
  for (const NodePacket& p : recorded) take(p, 0.01);
  EXPECT_EQ(node.outputs(), Command{});
  EXPECT_EQ(node.log().counters.sessions, 1);
}

TEST_F(NodeTest, CommandsThatWereHeldBackMoveNothing) {
  open(0.0);
  asked(0.001);
  take(command(0b0001), 0.001);
  const NodePacket before_the_timeout = command(0b0101);
  node.tick(0.030);
  ASSERT_EQ(node.log().counters.timeouts, 1);
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
  EXPECT_EQ(node.log().counters.old_packets, 25);
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
  EXPECT_EQ(node.log().counters.timeouts, 1);
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

TEST_F(NodeTest, AnOlderOfferDoesNotDisplaceTheSession) {
  const auto first = take(hello(11), 0.0);
  const NodePacket late = [&] {
    session = first->session;
    return opening();
  }();
  open(0.010);
  take(command(0b0001), 0.011);
  take(late, 0.012);  // of the same peer, held on its way
  EXPECT_EQ(node.outputs().switches, 0b0001u);
  EXPECT_EQ(node.log().counters.sessions, 1);
}

TEST_F(NodeTest, AFloodOfHellosKeepsNobodyFromOpening) {
  const auto offer = take(hello(11), 0.0);
  for (int k = 0; k < 1000; ++k)
    take(hello(static_cast<std::uint64_t>(k)), 0.001, {0x0A000000u + static_cast<std::uint32_t>(k), 1000});
  session = offer->session;
  EXPECT_TRUE(take(opening(), 0.002));
  EXPECT_EQ(node.log().counters.sessions, 1);
}

TEST_F(NodeTest, AnOfferHoldsForASecondAndForWhoAskedWithItsNumber) {
  session = take(hello(11), 0.5)->session;
  EXPECT_FALSE(take(opening(), 0.6, stranger));
  NodePacket other = packet(Type::open);
  other.append(std::uint64_t{12});
  EXPECT_FALSE(take(other, 0.6));
  EXPECT_FALSE(take(opening(), 2.1));
  session = take(hello(11), 2.2)->session;
  EXPECT_TRUE(take(opening(), 3.1));
  EXPECT_EQ(node.log().counters.foreign_packets, 3);
}

TEST_F(NodeTest, AStrangerGetsNoWordOfTheRunningSession) {
  open(0.0);
  EXPECT_FALSE(take(request(), 0.001, stranger));  // which would carry its number, and a tag
  EXPECT_EQ(node.log().counters.foreign_packets, 1);
}

TEST_F(NodeTest, RequestsThatWereKeptDoNotHoldTheNode) {
  open(0.0);
  std::vector<NodePacket> kept;
  for (int k = 0; k < 10; ++k) kept.push_back(request());
  double t = 0.0;
  for (const NodePacket& p : kept) take(p, t += 0.9);
  EXPECT_EQ(take(hello(12), t + 0.01, stranger)->type, Type::offer);
}

/// A link that brings one packet and keeps the answers.
class OnePacket final : public NodePort {
 public:
  explicit OnePacket(std::string bytes) : bytes_(std::move(bytes)) {}
  double now_s() override { return now_s_; }
  std::optional<std::string_view> receive(NodePeer& from) override {
    from = stranger;
    return std::exchange(here_, false) ? std::optional<std::string_view>(bytes_) : std::nullopt;
  }
  void send(std::string_view bytes, const NodePeer&) override { answers.emplace_back(bytes); }
  void wait(double seconds) override { now_s_ += seconds; }
  std::vector<std::string> answers;

 private:
  double now_s_ = 0.0;
  bool here_ = true;
  std::string bytes_;
};

TEST_F(NodeTest, AnotherVersionIsRefusedInWords) {
  OnePacket port("SLN1\1" + std::string(60, 'x'));
  serve(node, {}, port, [&] { return port.now_s() > 0.1; });
  ASSERT_EQ(port.answers.size(), 1u);
  const auto answer = NodePacket::decode(port.answers[0], nullptr);
  ASSERT_TRUE(answer && answer->type == Type::refuse);
  EXPECT_EQ(static_cast<NodeRefusal>(answer->word(0)), NodeRefusal::other_version);
  EXPECT_EQ(answer->text(4), "this node speaks version 2 of the protocol");
  EXPECT_EQ(node.log().counters.other_versions, 1);
  EXPECT_EQ(node.log().events.back().what,
            "refused 127.0.0.1:50001: it speaks another version of the protocol, this node version 2");
}

TEST_F(NodeTest, AnEmptyPacketIsCounted) {
  OnePacket port("");
  serve(node, {}, port, [&] { return port.now_s() > 0.1; });
  EXPECT_EQ(node.log().counters.packets, 1);
  EXPECT_EQ(node.log().counters.invalid_packets, 1);
}

TEST_F(NodeTest, ShortPacketsOfAnotherVersionAreNotAnsweredWithLongOnes) {
  OnePacket port("SLN3\1");
  serve(node, {}, port, [&] { return port.now_s() > 0.1; });
  EXPECT_TRUE(port.answers.empty());
  EXPECT_EQ(node.log().counters.other_versions, 1);
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
    const auto first = twin.take(opening(), from, t);
    seen_us = first->time_us;
    return from_microvolts(NodeSample::of(*first, 3)->microvolts[0]);
  };
  const double at_first = begin(0.0, operator_at);
  double t = 0.0;
  for (int k = 0; k < 600; ++k) {
    seen_us = twin.take(packet(Type::request), operator_at, t += 1e-3)->time_us;
    twin.take(command(0b1001, 5.0), operator_at, t);
  }
  const double moved =
      from_microvolts(NodeSample::of(*twin.take(packet(Type::request), operator_at, t), 3)->microvolts[0]);
  ASSERT_GT(moved, at_first + 1.0);
  twin.take(packet(Type::close), operator_at, t);
  EXPECT_NEAR(begin(t + 0.001, stranger), moved, 0.2);
}

}  // namespace
}  // namespace solenoid
