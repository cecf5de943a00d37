#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "core/mpc/mode_set.hpp"
#include "experiments/base/bytes.hpp"
#include "experiments/rig/node_protocol.hpp"
#include "experiments/rig/udp_io.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/rig/rig_parts.hpp"

#include <array>
#include <filesystem>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sodium/crypto_shorthash_siphash24.h>

namespace solenoid {
namespace {

using test::bytes_of;

constexpr NodeKey key_of(unsigned char first) {
  NodeKey key;
  for (unsigned char& byte : key.bytes) byte = first++;
  return key;
}
const NodeKey secret = key_of(0), another = key_of(1);

NodePacket some_command() {
  NodePacket p(NodePacket::Type::command);
  p.session = 0x0102030405060708;
  p.sequence = 0x1A2A3A4A5A6A7A8A;
  p.time_us = 0x1122334455667788;
  NodeCommand{9, {-1'500'000}, 0x0A0B0C0D0E0F0102}.put(p, 1);
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

/// Messages of every length up to some blocks, then of packets' lengths.
TEST(NodeTag, IsLibsodiumsAndZlibsAtEveryLength) {
  std::mt19937_64 random(1);
  std::string message;
  for (std::size_t size = 0; size <= NodePacket::most_size; size = message.size() + (size < 70 ? 1 : 37)) {
    while (message.size() < size) message.push_back(static_cast<char>(random()));
    NodeKey key;
    for (unsigned char& byte : key.bytes) byte = static_cast<unsigned char>(random());
    NodeTag tag;
    crypto_shorthash_siphashx24(reinterpret_cast<unsigned char*>(tag.data()),
                                reinterpret_cast<const unsigned char*>(message.data()), size, key.bytes.data());
    ASSERT_EQ(siphash_2_4_128(message, key), tag) << size;
    ASSERT_EQ(node_crc32(message), crc32(message)) << size;
  }
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

TEST(NodeAddress, IsAnAddressAndAPort) {
  EXPECT_EQ(parse_node_address("10.0.0.2:99").port, 99);
  for (const char* bad : {"", ":", "127.0.0.1", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:70000", "host:1", "127.0.0.1:x",
                          "127.0.0.1:47811x", "127.0.0.1: 47811", "127.0.0.1:+1", "127.0.0.1:99999999999"})
    EXPECT_THROW(parse_node_address(bad), ConfigError) << bad;
}

}  // namespace
}  // namespace solenoid
