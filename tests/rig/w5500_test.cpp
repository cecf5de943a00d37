// Compiled by the build for microcontrollers alone.
#include "experiments/rig/node/ports/template/w5500.cpp"  // NOLINT(bugprone-suspicious-include)

#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// The chip's far side of the SPI bus, as its datasheet has it: frames of two bytes of address, one of block and
/// direction, and data; one UDP socket with 2 KB each way, addressed modulo that.
struct FakeW5500 {
  static constexpr std::size_t buffer = 2048;
  std::vector<std::uint8_t> blocks[4] = {std::vector<std::uint8_t>(64), std::vector<std::uint8_t>(48),
                                         std::vector<std::uint8_t>(buffer), std::vector<std::uint8_t>(buffer)};
  std::vector<std::uint8_t> head;
  std::uint16_t at = 0, sent_to = 0, received_to = 0;
  bool selected = false;
  std::vector<std::pair<NodePeer, std::string>> sent;

  FakeW5500() { blocks[0][0x39] = 4; }
  std::uint16_t get16(std::size_t address) const {
    return static_cast<std::uint16_t>(blocks[1][address] << 8 | blocks[1][address + 1]);
  }
  void set16(std::size_t address, std::size_t value) {
    blocks[1][address] = static_cast<std::uint8_t>(value >> 8);
    blocks[1][address + 1] = static_cast<std::uint8_t>(value);
  }
  void select(bool on) {
    selected = on;
    head.clear();
  }
  void exchange(std::span<std::uint8_t> bytes) {
    ASSERT_TRUE(selected);
    for (std::uint8_t& byte : bytes) {
      if (head.size() < 3) {
        head.push_back(byte);
        if (head.size() == 3) at = static_cast<std::uint16_t>(head[0] << 8 | head[1]);
        continue;
      }
      ASSERT_LT(head[2] >> 3, 4);
      std::vector<std::uint8_t>& block = blocks[head[2] >> 3];
      const std::size_t place = head[2] >> 3 >= 2 ? at % buffer : at;
      ASSERT_LT(place, block.size());
      if ((head[2] & 4) != 0)
        write(block, place, byte);
      else
        byte = block[place];
      ++at;
    }
  }
  void write(std::vector<std::uint8_t>& block, std::size_t place, std::uint8_t byte) {
    block[place] = byte;
    if (&block == &blocks[0] && place == 0) block[0] &= 0x7f;  // the reset is over
    if (&block != &blocks[1] || place != 1) return;
    if (byte == 0x01 && block[0] == 0x02) {  // OPEN as UDP
      block[3] = 0x22;
      set16(0x20, buffer);
    }
    if (byte == 0x20) send();
    if (byte == 0x40) set16(0x26, static_cast<std::uint16_t>(received_to - get16(0x28)));
    block[1] = 0;  // done
  }
  void send() {
    std::string text;
    for (; sent_to != get16(0x24); ++sent_to) text += static_cast<char>(blocks[2][sent_to % buffer]);
    const auto& r = blocks[1];
    sent.push_back(
        {{std::uint32_t{r[0x0c]} << 24 | std::uint32_t{r[0x0d]} << 16 | std::uint32_t{r[0x0e]} << 8 | r[0x0f],
          get16(0x10)},
         text});
  }
  void come(const NodePeer& from, const std::string& text) {
    std::string all = {static_cast<char>(from.address >> 24), static_cast<char>(from.address >> 16),
                       static_cast<char>(from.address >> 8),  static_cast<char>(from.address),
                       static_cast<char>(from.port >> 8),     static_cast<char>(from.port),
                       static_cast<char>(text.size() >> 8),   static_cast<char>(text.size())};
    all += text;
    for (const char c : all) blocks[3][received_to++ % buffer] = static_cast<std::uint8_t>(c);
    set16(0x26, static_cast<std::uint16_t>(received_to - get16(0x28)));
  }
};

FakeW5500* far_side = nullptr;

std::string any_text(std::mt19937& random, std::size_t size) {
  std::string text(size, ' ');
  for (char& c : text) c = static_cast<char>(random());
  return text;
}

struct W5500Test : testing::Test {
  FakeW5500 fake;
  port::W5500 chip;
  void SetUp() override {
    far_side = &fake;
    ASSERT_TRUE(chip.start({2, 0, 0, 0, 0, 9}, {192, 168, 47, 2}, {255, 255, 255, 0}, {}, 47811));
  }
};

TEST_F(W5500Test, OpensAUdpSocketAtItsAddress) {
  EXPECT_THAT(std::span(fake.blocks[0]).subspan(0x0f, 4), testing::ElementsAre(192, 168, 47, 2));
  EXPECT_THAT(std::span(fake.blocks[0]).subspan(0x05, 4), testing::ElementsAre(255, 255, 255, 0));
  EXPECT_THAT(std::span(fake.blocks[0]).subspan(0x09, 6), testing::ElementsAre(2, 0, 0, 0, 0, 9));
  EXPECT_EQ(fake.get16(0x04), 47811);
  fake.blocks[0][0x39] = 0xff;  // nothing on the bus
  EXPECT_FALSE(chip.start({}, {}, {}, {}, 1));
}

/// Both buffers wrap many times over, and so do the pointers of 16 bits.
TEST_F(W5500Test, PacketsComeAndGoWhole) {
  std::mt19937 random(5);
  std::array<char, 1073> room;
  for (int i = 0; i < 400; ++i) {
    const NodePeer peer{static_cast<std::uint32_t>(random()), static_cast<std::uint16_t>(random())};
    const std::string first = any_text(random, random() % 900), second = any_text(random, random() % 900);
    fake.come(peer, first);
    fake.come(peer, second);
    for (const std::string& text : {first, second}) {
      NodePeer from;
      const std::size_t size = chip.receive(room, from);
      EXPECT_EQ(from, peer);
      // An empty packet is none that the node takes, and no end of the packets either.
      if (text.empty()) {
        EXPECT_EQ(size, 1u) << i;
      } else {
        ASSERT_EQ(std::string(room.data(), size), text) << i;
      }
    }
    NodePeer nobody;
    EXPECT_EQ(chip.receive(room, nobody), 0u);
    chip.send(first, peer);
    ASSERT_EQ(fake.sent.size(), static_cast<std::size_t>(i + 1));
    EXPECT_EQ(fake.sent.back().first, peer);
    ASSERT_EQ(fake.sent.back().second, first);
  }
}

TEST_F(W5500Test, OfATooLongPacketTheNodeSeesThatItIsOneAndTheNextIsWhole) {
  std::array<char, 100> room;
  fake.come({1, 2}, std::string(900, 'x'));
  fake.come({3, 4}, "hello");
  NodePeer from;
  EXPECT_EQ(chip.receive(room, from), room.size());
  ASSERT_EQ(chip.receive(room, from), 5u);
  EXPECT_EQ(std::string(room.data(), 5), "hello");
  EXPECT_EQ(from, (NodePeer{3, 4}));
}

TEST_F(W5500Test, WhatTheChipHasNoRoomForIsLost) {
  fake.set16(0x20, 10);
  chip.send(std::string(11, 'x'), {1, 2});
  EXPECT_TRUE(fake.sent.empty());
}

}  // namespace

void to_fill_in::spi_exchange(std::span<std::uint8_t> bytes) { far_side->exchange(bytes); }
void to_fill_in::spi_select(bool on) { far_side->select(on); }

}  // namespace solenoid
