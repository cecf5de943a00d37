#pragma once

#include "experiments/rig/calibration.hpp"
#include "experiments/rig/faulty_plant.hpp"
#include "experiments/rig/node/node.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// What an emulated node has seen; the operator's and the tests' evidence.
struct NodeLog {
  /// Something that a person wants to know.
  struct Event {
    double time_s;  ///< since the first session began
    std::string what;
  };
  std::vector<Event> events;
  NodeCounters counters;
  double longest_silence_s = 0.0;  ///< between two commands of a session
  double safe_after_s = 0.0;       ///< from the last command to the safe state, the longest of all timeouts
};

/// Where an emulated node takes packets and answers them, and the time it does.
class NodeLink {
 public:
  virtual ~NodeLink() = default;
  virtual double now_s() = 0;
  /// As NodeHardware has it; `time_s` is since the first session began, 0 before.
  virtual std::size_t receive(std::span<char> room, NodePeer& from, double time_s) = 0;
  virtual void send(std::string_view bytes, const NodePeer& to, double time_s) = 0;
};

/// What a node must be for a variant's switches and a calibration, its converters' counts being microvolts. What `wire` and
/// `key` point to must outlive it.
NodeDescription node_description(const Calibration& calibration, const ModeSet& modes, std::string_view wire,
                                 const NodeKey* key);

/// The reference node (node/node.hpp), the code of the firmware, on a board that is a simulated plant: this is the POSIX
/// port. Times are the caller's or its link's, in seconds, and never decrease. One plant for the node's whole life: it
/// stays where a session left it. Its time begins with the first session.
class EmulatedNode final : private NodeHardware {
 public:
  /// `wire`: what controllers must agree on (wire_text).
  EmulatedNode(std::unique_ptr<FaultyPlant> plant, const Calibration& calibration, const ModeSet& modes,
               std::string wire, const std::optional<NodeKey>& key = std::nullopt);
  EmulatedNode(const EmulatedNode&) = delete;
  EmulatedNode& operator=(const EmulatedNode&) = delete;
  ~EmulatedNode() = default;

  /// Takes a valid packet; the answer, if it asks for one.
  std::optional<NodePacket> take(const NodePacket& packet, const NodePeer& from, double now_s);
  /// At least once a millisecond: lets the plant's time pass and watches over the commands.
  void tick(double now_s);
  /// A round of the firmware's loop over a link; returns for how long nothing is due [s].
  double poll(NodeLink& link);

  /// Whether the plant's time has begun.
  bool begun() const { return begun_s_ >= 0.0; }
  /// Since the first session began.
  double time_s(double now_s) const { return now_s - begun_s_; }
  const Command& outputs() const { return plant_->outputs(); }
  NodeLog log() const;

 private:
  std::uint64_t now_us() noexcept override;
  std::uint64_t random() noexcept override;
  std::size_t receive(std::span<char> room, NodePeer& from) noexcept override;
  void send(std::span<const char> bytes, const NodePeer& to) noexcept override;
  void convert(std::span<std::int32_t> counts) noexcept override;
  void set_switches(std::uint32_t pattern) noexcept override;
  void set_output(std::size_t index, std::int32_t microvolts) noexcept override;
  void kick_watchdog() noexcept override {}      // the process is its own
  void wait(std::uint32_t) noexcept override {}  // the caller's
  void tell(NodeEvent event, const NodePeer& peer) noexcept override;

  /// The caller's time, or the link's.
  void at(double now_s);
  /// Lets the plant's time pass and gives it what the outputs have become.
  void advance();

  std::unique_ptr<FaultyPlant> plant_;
  Calibration calibration_;
  std::string wire_;
  std::optional<NodeKey> key_;
  NodeDescription description_;
  Node node_;
  NodeLink* link_ = nullptr;
  Command command_;
  bool commanded_ = false;  // command_ is not the plant's yet
  Measurement sensors_;
  double now_s_ = 0.0, begun_s_ = -1.0;
  std::vector<NodeLog::Event> events_;
  std::size_t refusals_told_ = 0;
};

}  // namespace solenoid
