#include "experiments/rig/node/node.hpp"

#include <cmath>
#include <cstring>
#include <deque>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// A board on a bench: its time passes when it rests, its inputs are a function of time.
class BenchBoard final : public NodeHardware {
 public:
  std::uint64_t now = 0, rested = 0, kicks = 0, random_state = 1;
  std::function<std::int32_t(double)> signal = [](double) { return 0; };
  std::uint64_t conversion_us = 0;  ///< that a conversion takes
  std::vector<std::uint64_t> conversions;
  std::deque<std::string> arriving;
  std::uint64_t packet_us = 0;  ///< that a packet takes
  std::vector<NodePacket> sent;
  std::uint32_t switches = 0xFFFF;
  std::array<std::int32_t, 2> outputs{1, 1};
  std::vector<NodeEvent> told;

  std::uint64_t now_us() noexcept override { return now; }
  std::uint64_t random() noexcept override { return random_state++; }
  std::size_t receive(std::span<char> room, NodePeer& from) noexcept override {
    if (arriving.empty()) return 0;
    const std::string packet = arriving.front();
    arriving.pop_front();
    now += packet_us;
    from = {0x0A000202, 5000};
    std::memcpy(room.data(), packet.data(), std::min(room.size(), packet.size()));
    return packet.size();
  }
  void send(std::span<const char> bytes, const NodePeer&) noexcept override {
    sent.push_back(NodePacket::decode({bytes.data(), bytes.size()}, nullptr).value());
  }
  void convert(std::span<std::int32_t> counts) noexcept override {
    conversions.push_back(now);
    for (std::int32_t& c : counts) c = signal(1e-6 * static_cast<double>(now));
    now += conversion_us;
  }
  void set_switches(std::uint32_t pattern) noexcept override { switches = pattern; }
  void set_output(std::size_t index, std::int32_t microvolts) noexcept override {
    if (index < outputs.size()) outputs[index] = microvolts;
  }
  void kick_watchdog() noexcept override { ++kicks; }
  void wait(std::uint32_t microseconds) noexcept override {
    rested += microseconds;
    now += std::max(microseconds, 1u);
  }
  void tell(NodeEvent event, const NodePeer&) noexcept override { told.push_back(event); }
};

NodeDescription described(std::uint32_t conversions) {
  NodeDescription d;
  d.wire = "bench";
  d.channels = 2;
  d.outputs = 2;
  d.switches = 0b1111;
  d.safe_switches = 0b0100;
  d.continuous[1].safe_microvolts = 250'000;
  d.inputs[1] = {-2'500'000, 100 << 16};
  d.sampling.conversions = conversions;
  return d;
}

struct NodeBoard : testing::Test {
  using Type = NodePacket::Type;
  BenchBoard board;
  NodeDescription description = described(8);
  Node node{description, board};
  std::uint64_t session = 0, sequence = 0;

  void arrive(NodePacket p) {
    p.session = session;
    p.sequence = ++sequence;
    std::array<char, NodePacket::most_size> room;
    board.arriving.emplace_back(room.data(), p.encode(room, nullptr));
  }
  void run_for(std::uint64_t microseconds) {
    for (const std::uint64_t until = board.now + microseconds; board.now < until;) node.run_once();
  }
  void open() {
    const std::uint64_t asked_with = session;
    NodePacket hello(Type::hello);
    hello.append(std::string_view("bench"));
    arrive(hello);
    run_for(100);
    ASSERT_EQ(board.sent.back().type, Type::offer);
    session = board.sent.back().session;
    NodePacket opening(Type::open);
    opening.append(asked_with);
    arrive(opening);
    run_for(100);
    ASSERT_EQ(board.sent.back().type, Type::sample);
  }
  NodeSample asked() {
    NodePacket request(Type::request);
    request.append(board.sent.back().time_us);
    arrive(request);
    node.poll();
    return NodeSample::of(board.sent.back(), 2).value();
  }
  void command(std::uint32_t switches) {
    NodePacket p(Type::command);
    NodeCommand{switches, {1'000'000, -1'000'000}, board.sent.back().time_us}.put(p, 2);
    arrive(p);
    node.poll();
  }
};

TEST_F(NodeBoard, StartsWithSafeOutputs) {
  node.start();
  EXPECT_EQ(board.switches, 0b0100u);
  EXPECT_EQ(board.outputs, (std::array<std::int32_t, 2>{0, 250'000}));
}

TEST_F(NodeBoard, ConvertsEightTimesAMillisecondAndFeedsTheWatchdogAllTheTime) {
  node.start();
  run_for(50'000);
  ASSERT_NEAR(static_cast<double>(board.conversions.size()), 400.0, 2.0);
  for (std::size_t i = 1; i < board.conversions.size(); ++i)
    EXPECT_EQ(board.conversions[i] - board.conversions[i - 1], 125u);
  EXPECT_GE(board.kicks, 100u);
  EXPECT_GE(board.rested, 45'000u);
}

/// A ramp is read without error where the sample says that it was measured, however the request falls.
TEST_F(NodeBoard, ASampleSaysWhenItWasMeasured) {
  board.signal = [](double t) { return static_cast<std::int32_t>(std::lround(1e6 * t)); };  // counts: microseconds
  node.start();
  open();
  std::mt19937_64 random(3);
  for (int k = 0; k < 500; ++k) {
    run_for(900 + random() % 300);
    const NodeSample s = asked();
    const auto measured = static_cast<double>(board.sent.back().time_us) - s.age_us;
    EXPECT_NEAR(s.microvolts[0], measured, 1.0);
    EXPECT_NEAR(s.microvolts[1], -2.5e6 + 100 * measured, 100.0);
    EXPECT_GE(s.age_us, 0);
    EXPECT_LE(s.age_us, 1000);
  }
}

/// |H(f)| of the mean of eight, against the closed form of the header, and noise averaged down by the root of eight.
TEST_F(NodeBoard, OversamplingFilters) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, 1000.0);
  board.signal = [&](double) { return static_cast<std::int32_t>(std::lround(noise(random))); };
  node.start();
  open();
  double squares = 0.0;
  constexpr int samples = 4000;
  for (int k = 0; k < samples; ++k) {
    run_for(1000);
    squares += std::pow(asked().microvolts[0], 2);
  }
  EXPECT_NEAR(std::sqrt(squares / samples), 1000.0 / std::sqrt(8.0), 12.0);
  for (const double f : {101.0, 307.0, 509.0, 701.0}) {
    board.signal = [f](double t) {
      return static_cast<std::int32_t>(std::lround(1e6 * std::sin(2 * std::numbers::pi * f * t)));
    };
    double most = 0.0;
    for (int k = 0; k < 2000; ++k) {
      run_for(1000 + static_cast<std::uint64_t>(k) * 7 % 400);
      most = std::max(most, std::abs(static_cast<double>(asked().microvolts[0])));
    }
    const double x = std::numbers::pi * f * 1e-3;
    EXPECT_NEAR(1e-6 * most, std::abs(std::sin(x) / (8 * std::sin(x / 8))), 2e-3) << f;
  }
}

TEST_F(NodeBoard, AfterAGapOldConversionsAreNoPartOfTheMean) {
  board.signal = [](double t) { return t < 0.5 ? 0 : 1000; };
  node.start();
  open();
  run_for(400'000 - board.now);
  board.now = 600'000;  // stood still
  EXPECT_EQ(asked().microvolts[0], 1000);
}

TEST_F(NodeBoard, SafeTwentyMillisecondsAfterTheLastCommandByItsOwnClock) {
  node.start();
  open();
  command(0b0011);
  EXPECT_EQ(board.switches, 0b0011u);
  EXPECT_EQ(board.outputs, (std::array<std::int32_t, 2>{1'000'000, -1'000'000}));
  run_for(18'900);
  EXPECT_EQ(board.switches, 0b0011u);
  run_for(200);
  EXPECT_EQ(board.switches, 0b0100u);
  EXPECT_EQ(board.outputs, (std::array<std::int32_t, 2>{0, 250'000}));
  EXPECT_EQ(node.counters().safe_after_us, node_timeout_us);
}

/// 20,000 packets a second, of which each takes the board 40 us, and then such that take longer than a round.
TEST_F(NodeBoard, AFloodKeepsItFromNothing) {
  for (const std::uint64_t packet_us : {40u, 400u}) {
    SCOPED_TRACE(packet_us);
    node.start();
    board.packet_us = 0;
    open();
    command(0b0011);
    board.packet_us = packet_us;
    const std::uint64_t begun = board.now, kicks = board.kicks;
    const std::int64_t invalid = node.counters().invalid_packets;
    const std::size_t conversions = board.conversions.size();
    std::uint64_t sent = 0;
    while (board.now - begun < 1'000'000) {
      for (; sent < (board.now - begun) / 50; ++sent) board.arriving.emplace_back(200, 'x');
      node.run_once();
    }
    board.arriving.clear();
    EXPECT_EQ(board.switches, 0b0100u);
    EXPECT_LE(node.counters().safe_after_us, node_timeout_us + packet_us);
    EXPECT_GT(node.counters().invalid_packets - invalid, packet_us == 40 ? 19'000 : 2'000);
    EXPECT_GT(board.kicks - kicks, 1'000u);
    EXPECT_GT(board.conversions.size() - conversions, packet_us == 40 ? 7'500u : 2'000u);
    EXPECT_EQ(node.counters().packets, node.counters().counted());
    board.now += 2 * node_hold_us;
  }
}

TEST_F(NodeBoard, AClockThatStandsStillIsLeftToTheWatchdog) {
  node.start();
  run_for(1'000);
  const std::uint64_t kicks = board.kicks;
  for (int k = 0; k < 1'000; ++k) node.poll();
  EXPECT_LE(board.kicks - kicks, 1u);
}

/// A board that comes round only each 1.9 ms: what is old is no part of the mean.
TEST_F(NodeBoard, ASlowBoardsMeanIsOfWhatIsNew) {
  board.signal = [](double t) { return static_cast<std::int32_t>(std::lround(1e6 * t)); };
  node.start();
  open();
  for (int k = 0; k < 50; ++k) {
    board.now += 1'900;
    const NodeSample s = asked();
    EXPECT_LE(s.age_us, 1'000);
    EXPECT_NEAR(s.microvolts[0], static_cast<double>(board.sent.back().time_us) - s.age_us, 1.0);
  }
}

TEST_F(NodeBoard, OneConversionASampleIsTakenWhenItIsAskedFor) {
  NodeDescription d = described(1);
  Node one(d, board);
  one.start();
  for (int k = 0; k < 100; ++k) one.run_once();
  EXPECT_TRUE(board.conversions.empty());
}

TEST_F(NodeBoard, WhatADescriptionHasTooMuchOfIsLeftOut) {
  NodeDescription d = described(8);
  d.channels = d.outputs = 1000;
  Node many(d, board);
  board.outputs = {};
  many.start();  // the board's own two are the first of sixteen
  many.tick();
  EXPECT_EQ(board.conversions.size(), 1u);
}

TEST_F(NodeBoard, ConvertersCountsBecomeMicrovoltsToTheNearest) {
  EXPECT_EQ((NodeInput{7, 1 << 16}).microvolts(-21, 2), 7 - 11);  // halves away from zero
  EXPECT_EQ((NodeInput{0, 3 << 15}).microvolts(4095, 1), 6143);
  EXPECT_EQ((NodeInput{0, 20'000'000}).microvolts(8 * 4095, 8), 1'249'695);
}

}  // namespace
}  // namespace solenoid
