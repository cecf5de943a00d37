#include "experiments/rig/node/node.hpp"
#include "experiments/rig/node/ports/mps2_an385/registers.hpp"
#include "experiments/rig/node/ports/network.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <new>
#include <string_view>
#include <utility>

// How many instructions of a Cortex-M3 the node needs for a packet, from the Ethernet frame to the answer's frame: an
// image that plays both sides under QEMU with -icount shift=0, whose clock goes on by a nanosecond an instruction. What
// the Ethernet chip costs to read and to write, a word of it at a time, is not in it.

using namespace solenoid;

extern "C" {
extern std::uint32_t stack_top[], data_begin[], data_end[], bss_begin[], bss_end[];
extern const std::uint32_t data_image[];
[[noreturn]] void start();
}

namespace {

constexpr std::uint32_t node_address = 0x0a00020f, own_address = 0x0a000202;
constexpr std::uint16_t own_port = 5000;
constexpr MacAddress node_mac{2, 0, 0, 0, 0, 1}, own_mac{2, 0, 0, 0, 0, 2};
constexpr std::uint32_t nanoseconds_a_count = 40, rounds = 256;
constexpr std::string_view wire = "a node of three channels, an output and four switches";
using Frame = std::array<char, Network::most_frame>;

/// A board without anything but its network: frames come from memory, and go there.
class CountingBoard final : public NodeHardware {
 public:
  std::uint64_t now_us() noexcept override { return clock_us; }
  std::uint64_t random() noexcept override { return 0x123456789abcdef; }
  std::size_t receive(std::span<char> room, NodePeer& from) noexcept override {
    if (frame.empty()) return 0;
    const auto taken = network.take(std::exchange(frame, {}), answer);
    if (!taken.from) return 0;
    from = *taken.from;
    const std::size_t size = std::min(room.size(), taken.payload.size());
    std::memcpy(room.data(), taken.payload.data(), size);
    return size;
  }
  void send(std::span<const char> bytes, const NodePeer& to) noexcept override {
    sent = network.make(bytes, to, answer);
  }
  void convert(std::span<std::int32_t> counts) noexcept override { std::ranges::fill(counts, 1000); }
  void set_switches(std::uint32_t pattern) noexcept override { switches = pattern; }
  void set_output(std::size_t, std::int32_t microvolts) noexcept override { output = microvolts; }
  void kick_watchdog() noexcept override {}
  void wait(std::uint32_t) noexcept override {}
  void tell(NodeEvent, const NodePeer&) noexcept override {}

  Network network{{node_mac, node_address, static_cast<std::uint16_t>(node_port)}};
  std::uint64_t clock_us = 1'000'000;
  std::span<const char> frame, sent;
  std::uint32_t switches = 0;
  std::int32_t output = 0;
  Frame answer{};
};

alignas(CountingBoard) char board_room[sizeof(CountingBoard)];
alignas(Node) char node_room[sizeof(Node)];
NodeDescription description;
NodePacket packet, heard;
Frame frame;
std::array<char, NodePacket::most_size> bytes;

void say(std::string_view text) {
  for (const char c : text) mps2::at(mps2::uart_data) = static_cast<unsigned char>(c);
}
void say(std::uint32_t number) {
  char digits[10];
  int first = 10;
  do digits[--first] = static_cast<char>('0' + number % 10);
  while ((number /= 10) != 0);
  say({digits + first, static_cast<std::size_t>(10 - first)});
}

/// A node of the wire's text.
const NodeDescription& described(const NodeKey* key) {
  description.wire = wire;
  description.key = key;
  description.channels = 3;
  description.outputs = 1;
  description.switches = 15;
  return description;
}

/// The controller: makes packets, reads answers.
class Count {
 public:
  explicit Count(const NodeKey* key) : key_(key) {}

  void all() {
    node_.start();
    open();
    board_.sent = {};
    const std::uint32_t idle = a_round([](Count&) {});
    tell("round without a packet", idle, 0);
    tell("request and its sample", a_round([](Count& c) {
           c.prepare(NodePacket::Type::request, [](NodePacket& p, const Count& of) { p.append(of.board_.clock_us); });
         }),
         idle);
    if (answered_ != rounds) say("no session, or no samples\n");
    tell("command", a_round([](Count& c) {
           c.prepare(NodePacket::Type::command, [](NodePacket& p, const Count& of) {
             NodeCommand command{5, {}, of.board_.clock_us};
             command.microvolts[0] = 1'000'000;
             command.put(p, 1);
           });
         }),
         idle);
    tell("forged packet", a_round([](Count& c) {
           c.prepare(NodePacket::Type::command, [](NodePacket& p, const Count&) { NodeCommand{}.put(p, 1); });
           c.spoil_tag();
         }),
         idle);
    tell("packet of 1072 bytes that is none", a_round([](Count& c) {
           c.prepare(NodePacket::Type::command,
                     [](NodePacket& p, const Count&) { p.length = NodePacket::most_payload; });
         }),
         idle);
  }

 private:
  using Fill = void (*)(NodePacket&, const Count&);

  void prepare(
      NodePacket::Type type, Fill fill = [](NodePacket&, const Count&) {}) {
    packet.type = type;
    packet.length = 0;
    packet.session = session_;
    packet.sequence = ++sequence_;
    fill(packet, *this);
    wrap({bytes.data(), packet.encode(bytes, key_)});
  }
  /// Puts a UDP packet into a frame to the node: as a Network with the addresses the other way round would.
  void wrap(std::span<const char> payload) {
    Network there({own_mac, own_address, own_port});
    there.take(there_heard_, scratch_);
    board_.frame = there.make(payload, {node_address, static_cast<std::uint16_t>(node_port)}, frame);
  }
  /// One byte of the tag becomes another, under a UDP checksum that is none: which is allowed.
  void spoil_tag() {
    const std::size_t size = board_.frame.size();
    frame[size - 1] = static_cast<char>(frame[size - 1] + 1);
    frame[40] = frame[41] = 0;
  }

  /// What a round costs in which a prepared frame has come [instructions].
  template <class Prepare>
  std::uint32_t a_round(const Prepare& prepare) {
    std::uint32_t counted = 0;
    for (std::uint32_t i = 0; i < rounds; ++i) {
      prepare(*this);
      board_.clock_us += 1000;
      const std::uint32_t begun = mps2::at(mps2::counter);
      node_.poll();
      counted += mps2::at(mps2::counter) - begun;
      answered_ += board_.sent.size() > Network::headers ? 1u : 0u;
      board_.sent = {};
      board_.frame = {};
    }
    return counted * nanoseconds_a_count / rounds;
  }

  void tell(std::string_view what, std::uint32_t round, std::uint32_t idle) {
    say(key_ ? "with a key, " : "without a key, ");
    say(what);
    say(": ");
    say(round - idle);
    say("\n");
  }

  void open() {
    // A frame of the node's, from which the far side learns where it is: made as if it had sent one.
    Network node({node_mac, node_address, static_cast<std::uint16_t>(node_port)});
    const auto first = greeting(frame);
    node.take(first, scratch_);
    const auto made = node.make({}, {own_address, own_port}, there_room_);
    there_heard_ = made;

    prepare(NodePacket::Type::hello, [](NodePacket& p, const Count&) { p.append(wire); });
    node_.poll();
    hear();
    session_ = heard.session;
    prepare(NodePacket::Type::open,
            [](NodePacket& p, const Count&) { p.append(std::uint64_t{0}); });  // as in its hello
    node_.poll();
    hear();
    if (heard.type != NodePacket::Type::sample) say("no session\n");
  }
  /// A UDP packet without a checksum, made by hand: what introduces the two to each other.
  std::span<const char> greeting(Frame& out) {
    constexpr std::array<unsigned char, 42> by_hand = {2,
                                                       0,
                                                       0,
                                                       0,
                                                       0,
                                                       1,
                                                       2,
                                                       0,
                                                       0,
                                                       0,
                                                       0,
                                                       2,
                                                       8,
                                                       0,  // Ethernet
                                                       0x45,
                                                       0,
                                                       0,
                                                       28,
                                                       0,
                                                       0,
                                                       0,
                                                       0,
                                                       64,
                                                       17,
                                                       0,
                                                       0,
                                                       10,
                                                       0,
                                                       2,
                                                       2,
                                                       10,
                                                       0,
                                                       2,
                                                       15,  // IPv4
                                                       own_port >> 8,
                                                       own_port & 255,
                                                       node_port >> 8,
                                                       node_port & 255,
                                                       0,
                                                       8,
                                                       0,
                                                       0};  // UDP
    std::memcpy(out.data(), by_hand.data(), by_hand.size());
    const std::uint32_t sum = ~internet_sum({out.data() + 14, 20});
    out[24] = static_cast<char>(sum >> 8);
    out[25] = static_cast<char>(sum);
    return {out.data(), by_hand.size()};
  }
  void hear() {
    if (board_.sent.size() > Network::headers)
      NodePacket::decode({board_.sent.data() + Network::headers, board_.sent.size() - Network::headers}, key_, heard);
  }

  const NodeKey* key_;
  CountingBoard& board_ = *new (board_room) CountingBoard;
  Node& node_ = *new (node_room) Node(described(key_), board_);
  std::span<const char> there_heard_;
  std::uint64_t session_ = 0, sequence_ = 0;
  std::uint32_t answered_ = 0;
  Frame there_room_{}, scratch_{};
};

alignas(Count) char count_room[sizeof(Count)];

/// Ends QEMU (Arm's semihosting, SYS_EXIT).
[[noreturn]] void end() {
  register std::uint32_t call __asm__("r0") = 0x18;
  register std::uint32_t why __asm__("r1") = 0x20026;
  for (;;) __asm__ volatile("bkpt 0xab" ::"r"(call), "r"(why));
}

}  // namespace

extern "C" void start() {
  const std::uint32_t* from = data_image;
  for (std::uint32_t* to = data_begin; to < data_end; ++to) *to = *from++;
  for (std::uint32_t* at = bss_begin; at < bss_end; ++at) *at = 0;
  mps2::at(mps2::uart_divider) = 16;
  mps2::at(mps2::uart_control) = 1;
  mps2::at(mps2::prescale) = 0;
  static constexpr NodeKey key{{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}};
  (new (count_room) Count(nullptr))->all();
  (new (count_room) Count(&key))->all();
  end();
}

extern "C" {
/// The stack, and where it begins.
struct Vectors {
  std::uint32_t* stack;
  void (*begin)();
};
extern const Vectors vectors;
__attribute__((section(".vectors"), used)) constexpr Vectors vectors{stack_top, start};
}
