#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "tests/rig/node_fixture.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using test::bytes_of;
using test::NodeTest;
using test::operator_at;
using test::stranger;
using test::with_valves;

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
