#pragma once

#include "experiments/rig/calibration.hpp"
#include "experiments/rig/faulty_plant.hpp"
#include "experiments/rig/node_protocol.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// What an emulated node has seen; the operator's and the tests' evidence.
struct NodeLog {
  struct Event {
    double time_s;  ///< since the first session began
    std::string what;
  };
  std::vector<Event> events;
  std::int64_t sessions = 0, commands = 0, old_packets = 0, foreign_packets = 0, asked = 0, timeouts = 0, refused = 0;
  double longest_silence_s = 0.0;  ///< between two commands of a session
  double safe_after_s = 0.0;       ///< from the last command to the safe state, of the latest of all timeouts
};

/// Where a packet came from.
struct NodePeer {
  std::uint32_t address = 0;  ///< IPv4, in the host's byte order
  std::uint16_t port = 0;
  bool operator==(const NodePeer&) const = default;
  std::string text() const;
};

/// The node's side of the protocol over a plant: what a microcontroller would do. Knows no socket and no clock; times
/// are the caller's, in seconds, and never decrease. One plant for the node's whole life: it stays where a session left
/// it. Its time begins with the first session.
///
/// One controller has the node at a time: the peer that opened, until it closes or nothing was heard of it for
/// node_hold_s. Whoever else asks meanwhile is refused, and both are told. Commands that were held back on their way
/// are none: a timeout is looked for before each packet, and a command says which sample its controller had seen.
class EmulatedNode {
 public:
  /// `wire`: what controllers must agree on (wire_text).
  EmulatedNode(std::unique_ptr<FaultyPlant> plant, const Calibration& calibration, const ModeSet& modes,
               std::string wire);

  /// Takes a valid packet; the answer, if it asks for one.
  std::optional<NodePacket> take(const NodePacket& packet, const NodePeer& from, double now_s);
  /// At least once a millisecond: lets the plant's time pass and watches over the commands.
  void tick(double now_s);

  /// Whether the plant's time has begun.
  bool begun() const { return begun_s_ >= 0.0; }
  /// Since the first session began.
  double time_s(double now_s) const { return now_s - begun_s_; }
  const Command& outputs() const { return plant_->outputs(); }
  const NodeLog& log() const { return log_; }

 private:
  /// A session that was offered and has not begun.
  struct Offer {
    NodePeer peer;
    std::uint64_t session = 0;
    double until_s = 0.0;
  };
  bool taken(double now_s) const { return session_ != 0 && now_s - heard_s_ < node_hold_s; }
  NodePacket welcome(const NodePacket& hello, const NodePeer& from, double now_s);
  std::optional<NodePacket> open(const NodePacket& packet, const NodePeer& from, double now_s);
  void begin_session(const Offer& offer, double now_s);
  NodePacket refuse(const NodePacket& packet, NodeRefusal why, const std::string& text);
  NodePacket busy(const NodePacket& packet, const NodePeer& from, double now_s);
  /// Whether a controller sent this lately, and after the last timeout.
  bool of_now(const NodeCommand& command, double now_s) const;
  void command(const NodePacket& packet, double now_s);
  void make_safe(double now_s, const char* why);
  NodePacket sample(const NodePacket& asked, double now_s);
  /// Makes the outputs safe if no command came for too long.
  void watch(double now_s);
  void advance(double now_s);
  std::uint64_t time_us(double now_s) const { return static_cast<std::uint64_t>(1e6 * time_s(now_s)); }
  void event(double now_s, std::string what);

  std::unique_ptr<FaultyPlant> plant_;
  Calibration calibration_;
  Command safe_command_;
  SwitchPattern known_switches_;
  std::string wire_;
  NodeLog log_;
  Measurement sensors_;
  std::array<Offer, 4> offers_{};  // the oldest gives way
  std::size_t next_offer_ = 0;
  NodePeer peer_, last_foreign_;
  std::uint64_t session_ = 0, newest_ = 0, answers_ = 0, timeout_us_ = 0;
  double begun_s_ = -1.0, last_command_s_ = 0.0, heard_s_ = 0.0, now_s_ = 0.0;
  std::int32_t session_timeouts_ = 0, session_refused_ = 0, session_asked_ = 0;
  std::size_t refusals_told_ = 0;
  bool safe_ = true, commanded_ = false;
};

}  // namespace solenoid
