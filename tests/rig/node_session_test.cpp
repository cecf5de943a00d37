#include "tests/rig/node_fixture.hpp"

#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using test::bytes_of;
using test::NodeTest;
using test::stranger;

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
  kept.reserve(10);
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

}  // namespace
}  // namespace solenoid
