#pragma once

#include "experiments/rig/node/hardware.hpp"
#include "experiments/rig/node/packet.hpp"
#include "experiments/rig/node/sampler.hpp"

#include <array>
#include <cstdint>
#include <string_view>

namespace solenoid {

/// A continuous output of a node.
struct NodeOutput {
  std::int32_t most_microvolts = 5'000'000;  ///< either way
  std::int32_t safe_microvolts = 0;
};

/// What a node is: constants of a board and its wiring. Whatever it points to outlives the node.
struct NodeDescription {
  std::string_view
      wire;  ///< what controllers must agree on, to the letter (wire_text in the program; `solenoid list wires`)
  const NodeKey* key = nullptr;  ///< none: whoever can send packets can drive the node
  std::size_t channels = 0, outputs = 0;
  std::uint32_t switches = 0;       ///< a bit for each that there is
  std::uint32_t safe_switches = 0;  ///< those that are on in the safe state
  std::array<NodeInput, most_node_channels> inputs{};
  std::array<NodeOutput, most_node_outputs> continuous{};
  SamplerSettings sampling{};
};

/// What a node has seen since it was started. Each packet that came is counted in one of the first group, and there once.
struct NodeCounters {
  std::int64_t commands = 0;  ///< obeyed
  std::int64_t requests = 0;  ///< answered with a sample
  std::int64_t sessions = 0;  ///< opened
  std::int64_t safes = 0, closes = 0;
  std::int64_t offers = 0;           ///< hellos answered with one
  std::int64_t asked = 0;            ///< by others than the controller that has the node: refused
  std::int64_t other_wires = 0;      ///< hellos of another wire: refused
  std::int64_t refused = 0;          ///< commands that the outputs cannot be
  std::int64_t old_packets = 0;      ///< taken before, or held back
  std::int64_t foreign_packets = 0;  ///< of no session, from another address, or of a node
  std::int64_t invalid_packets = 0;  ///< of another length, magic or tag
  std::int64_t other_versions = 0;   ///< of the protocol: refused

  std::int64_t packets = 0;  ///< all that came
  std::int64_t timeouts = 0;
  std::uint64_t longest_silence_us = 0;  ///< between two commands of a session
  std::uint64_t safe_after_us = 0;       ///< from the last command to the safe state, the longest of all timeouts

  /// The sum of the first group: `packets`.
  std::int64_t counted() const noexcept {
    return commands + requests + sessions + safes + closes + offers + asked + other_wires + refused + old_packets +
           foreign_packets + invalid_packets + other_versions;
  }
};

/// The I/O node: the protocol's far side over a board (docs/reference/rig.md has the rules). No heap, no exceptions, no
/// floating point, no library beyond the headers of C++, and no clock or socket but the board's.
///
///     node.start();
///     for (;;) node.run_once();
///
/// One controller has the node at a time: the peer that opened, until it closes or nothing was heard of it for
/// node_hold_us. Whoever else asks meanwhile is refused, and both are told. Commands that were held back on their way
/// are none: a timeout is looked for before each packet, and a command says which sample its controller had seen.
///
/// An offered session is a number that the node can make again from who asked, with what number, when, and a secret of its
/// own: so offers take no memory, and nobody can fill it (as TCP's SYN cookies, RFC 4987). Every session that begins makes
/// those offered before it worthless.
class Node {
 public:
  /// Channels and outputs beyond what a packet has room for are left out.
  Node(const NodeDescription& description, NodeHardware& board) noexcept;

  /// Makes the outputs safe. Once, before all else.
  void start() noexcept;
  /// A round of the node's life: takes packets, does what is due, feeds the watchdog, and rests till something is due.
  void run_once() noexcept;
  /// A round without its rest. However many packets come, it looks at time before each, and after 32 of them or half a
  /// millisecond does the rest of the round.
  void poll() noexcept;
  /// How long nothing is due [us], at most half a millisecond.
  std::uint32_t rest_us() const noexcept;

  /// Takes a valid packet; the answer, if it asks for one, valid until the next call.
  const NodePacket* take(const NodePacket& packet, const NodePeer& from) noexcept;
  /// Looks for a timeout and converts what is due.
  void tick() noexcept;

  bool safe() const noexcept { return safe_; }
  /// Who has the node, or had it last.
  const NodePeer& peer() const noexcept { return peer_; }
  const NodeCounters& counters() const noexcept { return counters_; }
  /// When the newest command that was obeyed came [us].
  std::uint64_t last_command_us() const noexcept { return last_command_us_; }

 private:
  bool taken() const noexcept { return session_ != 0 && now_us_ - heard_us_ < node_hold_us; }
  void take_bytes(std::string_view bytes, const NodePeer& from) noexcept;
  const NodePacket* take_of_a_stranger(const NodePacket& packet, const NodePeer& from) noexcept;
  void send(const NodePacket& packet, const NodePeer& to) noexcept;
  const NodePacket* welcome(const NodePacket& hello, const NodePeer& from) noexcept;
  const NodePacket* open(const NodePacket& packet, const NodePeer& from) noexcept;
  void begin_session(std::uint64_t session, const NodePeer& from) noexcept;
  /// The number of a session that is offered to a peer which asked with a number, in one of the seconds of the node's time.
  std::uint64_t offered(const NodePeer& to, std::uint64_t asked_with, std::uint64_t second) const noexcept;
  const NodePacket* refuse(std::uint64_t session, NodeRefusal why, std::string_view text) noexcept;
  const NodePacket* busy(std::uint64_t session, const NodePeer& from) noexcept;
  /// Whether who sent this had seen a sample lately.
  bool of_now(std::uint64_t seen_us) const noexcept;
  /// Whether bytes may be a packet for this node: what can be told without the tag, which takes longest.
  bool worth_a_tag(std::string_view bytes) const noexcept;
  bool possible(const NodeCommand& command) const noexcept;
  void command(const NodePacket& packet) noexcept;
  void set_safe_outputs() noexcept;
  void make_safe(NodeEvent why) noexcept;
  const NodePacket* sample(const NodePacket& asked) noexcept;
  void watch() noexcept;
  /// The answer, begun anew.
  NodePacket& answer(NodePacket::Type type, std::uint64_t session) noexcept;

  NodeDescription of_;
  NodeHardware& board_;
  Sampler sampler_;
  NodeCounters counters_;
  NodeKey secret_;  // of its offers
  NodePeer peer_, last_asking_, last_other_version_;
  std::uint64_t session_ = 0, answers_ = 0;
  // A command that overtakes a request makes it no older: a request asks, and sets nothing.
  std::uint64_t newest_ = 0, newest_request_ = 0;
  std::uint64_t now_us_ = 0, kicked_us_ = 0, timeout_us_ = 0, last_command_us_ = 0, heard_us_ = 0;
  std::int32_t session_timeouts_ = 0, session_refused_ = 0, session_asked_ = 0;
  bool safe_ = true, commanded_ = false;
  NodePacket packet_, answer_;
  std::array<char, NodePacket::most_size + 1> bytes_;  // one more than a packet has: what is too long shows
};

}  // namespace solenoid
