#include "experiments/rig/node/packet.hpp"
#include "experiments/rig/node/ports/network.hpp"

#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

constexpr MacAddress node_mac{0x02, 0, 0, 0, 0, 0x0f}, other_mac{0x02, 0, 0, 0, 0, 0x02};
constexpr std::uint32_t node_at = 0x0a00020f, other_at = 0x0a000202;
constexpr std::uint16_t udp = 47811, other_udp = 5000;

std::string of_hex(std::string_view digits) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
    while (digits[i] == ' ') ++i;
    bytes += static_cast<char>(std::stoi(std::string(digits.substr(i, 2)), nullptr, 16));
  }
  return bytes;
}

struct NetworkTest : testing::Test {
  Network node{{node_mac, node_at, udp}};
  std::array<char, Network::most_frame> room{};
  // "hello" from 10.0.2.2:5000 to 10.0.2.15:47811, its checksums to be made.
  std::string frame =
      of_hex("02000000000f 020000000002 0800 45000021 12344000 4011 1072 0a000202 0a00020f 1388 bac3 000d 0000") +
      "hello";

  void set16(std::size_t at, std::uint32_t value) {
    frame[at] = static_cast<char>(value >> 8);
    frame[at + 1] = static_cast<char>(value);
  }
  /// Makes both checksums right again.
  void seal() {
    set16(24, 0);
    set16(24, ~internet_sum(std::span(frame).subspan(14, 20)));
    set16(40, 0);
    const std::size_t size = frame.size() - 34;
    std::string covered = frame.substr(26, 8) + std::string{0, 17} + frame.substr(38, 2) + frame.substr(34, size);
    set16(40, ~internet_sum(covered));
  }
  std::optional<std::string> payload() {
    const auto taken = node.take(frame, room);
    if (!taken.from) return std::nullopt;
    EXPECT_EQ(*taken.from, (NodePeer{other_at, other_udp}));
    return std::string(taken.payload.begin(), taken.payload.end());
  }
};

TEST(InternetSum, IsThatOfTheStandardsExample) {
  EXPECT_EQ(internet_sum(of_hex("0001f203f4f5f6f7")), 0xddf2u);  // RFC 1071, section 3
  EXPECT_EQ(internet_sum(of_hex("f4f5f6f7"), internet_sum(of_hex("0001f203"))), 0xddf2u);
  EXPECT_EQ(internet_sum(of_hex("0001f2")), 0xf201u);
}

TEST_F(NetworkTest, TakesAUdpPacketOfItsPort) {
  seal();
  EXPECT_EQ(payload(), "hello");
  set16(40, 0);  // a sender need not make UDP's checksum
  EXPECT_EQ(payload(), "hello");
  frame += std::string(13, 'x');  // Ethernet fills short frames up
  EXPECT_EQ(payload(), "hello");
}

TEST_F(NetworkTest, IgnoresWhatIsNotForItOrNotWhole) {
  seal();
  const std::string good = frame;
  const auto refused = [&](const char* what, std::size_t at, char value, bool sealed = true) {
    frame = good;
    frame[at] = value;
    if (sealed) seal();
    EXPECT_FALSE(payload()) << what;
  };
  refused("another Ethernet address", 5, 0x11);
  refused("from an address of many", 6, 0x03);
  refused("IPv6", 12, static_cast<char>(0x86));
  refused("IP version 6", 14, 0x65);
  refused("options", 14, 0x46);
  refused("longer than the frame", 17, 0x22);
  refused("shorter than its header", 17, 0x13);
  refused("more fragments", 20, 0x20);
  refused("a later fragment", 21, 1);
  refused("TCP", 23, 6);
  refused("a header that was spoiled", 25, 0x11, false);
  refused("from the node's own address", 29, 0x0f);
  refused("from nobody", 26, 0);
  refused("from loopback", 26, 127);
  refused("from a group", 26, static_cast<char>(224));
  refused("to another address", 33, 0x10);
  refused("to another port", 37, 0x11);
  refused("UDP longer than IP", 39, 14);
  refused("UDP shorter than its header", 39, 7);
  refused("a payload that was spoiled", 45, 'x', false);
  frame = good;
  set16(34, 0);
  seal();
  EXPECT_FALSE(payload()) << "from port 0";
}

TEST_F(NetworkTest, AnswersTheWhoHasOfItsAddressAlone) {
  frame = of_hex("ffffffffffff 020000000002 0806 0001 0800 06 04 0001 020000000002 0a000202 000000000000 0a00020f");
  const auto answer = node.take(frame, room).answer;
  EXPECT_EQ(std::string(answer.begin(), answer.end()),
            of_hex("020000000002 02000000000f 0806 0001 0800 06 04 0002 02000000000f 0a00020f 020000000002 0a000202"));
  for (const std::size_t byte : {15u, 17u, 18u, 19u, 21u, 41u}) {
    std::string other = frame;
    other[byte] = static_cast<char>(other[byte] + 1);
    EXPECT_TRUE(node.take(other, room).answer.empty()) << byte;
  }
  EXPECT_TRUE(node.take(std::string_view(frame).substr(0, frame.size() - 1), room).answer.empty());
}

TEST_F(NetworkTest, EchoesAPing) {
  frame = frame.substr(0, 34) + of_hex("0800 0000 0001 0002") + "abcdefg";
  set16(16, static_cast<std::uint32_t>(frame.size() - 14));
  frame[23] = 1;
  set16(36, ~internet_sum(std::span(frame).subspan(34)));
  set16(24, 0);
  set16(24, ~internet_sum(std::span(frame).subspan(14, 20)));
  const auto answer = node.take(frame, room).answer;
  ASSERT_EQ(answer.size(), frame.size());
  EXPECT_EQ(answer[34], 0);
  EXPECT_EQ(std::string(answer.begin() + 38, answer.end()), frame.substr(38));
  EXPECT_EQ(internet_sum(answer.subspan(34)), 0xffffu);
  EXPECT_EQ(internet_sum(answer.subspan(14, 20)), 0xffffu);
  EXPECT_EQ(std::string(answer.begin() + 30, answer.begin() + 34), frame.substr(26, 4));
  frame[44] = 'x';
  EXPECT_TRUE(node.take(frame, room).answer.empty());
}

TEST_F(NetworkTest, WhatItMakesTheOtherSideTakes) {
  EXPECT_TRUE(node.make("hello", {other_at, other_udp}, room).empty());  // of whom it has not heard
  seal();
  ASSERT_TRUE(payload());
  Network other({other_mac, other_at, other_udp});
  std::mt19937 random(3);
  for (std::size_t size = 0; size <= Network::most_payload; size += 1 + random() % 40) {
    std::string text(size, ' ');
    for (char& c : text) c = static_cast<char>(random());
    const auto made = node.make(text, {other_at, other_udp}, room);
    ASSERT_EQ(made.size(), size + Network::headers);
    std::array<char, Network::most_frame> scratch;
    const auto taken = other.take(made, scratch);
    ASSERT_TRUE(taken.from) << size;
    EXPECT_EQ(*taken.from, (NodePeer{node_at, udp}));
    EXPECT_EQ(std::string(taken.payload.begin(), taken.payload.end()), text);
  }
  EXPECT_TRUE(node.make(std::string(Network::most_payload + 1, 'x'), {other_at, other_udp}, room).empty());
}

/// Frames that were spoiled at random: whatever is taken lies within the frame, and an answer within its room and no
/// longer than what was asked.
TEST_F(NetworkTest, StaysWithinAnyFrame) {
  seal();
  const std::string good = frame + std::string(1472, 'x');
  std::mt19937 random(7);
  int taken_at_all = 0;
  for (int i = 0; i < 200'000; ++i) {
    frame = good.substr(0, random() % (good.size() + 1));
    for (unsigned changes = random() % 4; changes > 0 && !frame.empty(); --changes)
      frame[random() % std::min<std::size_t>(frame.size(), 50)] = static_cast<char>(random());
    if (frame.size() > 42 && random() % 2 == 0) set16(16, static_cast<std::uint32_t>(random() % 1600));
    if (frame.size() > 42 && random() % 2 == 0) set16(38, static_cast<std::uint32_t>(random() % 1600));
    if (frame.size() > 42 && random() % 2 == 0) seal();
    const std::string exact = frame;  // of just this size: a reader beyond it is seen under sanitizers
    const auto taken = node.take(exact, room);
    if (taken.from) {
      ++taken_at_all;
      ASSERT_GE(taken.payload.data(), exact.data());
      ASSERT_LE(taken.payload.data() + taken.payload.size(), exact.data() + exact.size());
    }
    ASSERT_LE(taken.answer.size(), std::max<std::size_t>(exact.size(), 42));
  }
  EXPECT_GT(taken_at_all, 1000);
}

}  // namespace
}  // namespace solenoid
