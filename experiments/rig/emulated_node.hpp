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
    double time_s;  ///< of the session
    std::string what;
  };
  std::vector<Event> events;
  std::int64_t sessions = 0, commands = 0, old_packets = 0, timeouts = 0, refused = 0;
  double longest_silence_s = 0.0;  ///< between two commands of a session
  double safe_after_s = 0.0;       ///< from the last command to the safe state, of the last timeout
};

/// The node's side of the protocol over a plant: what a microcontroller would do. Knows no socket and no clock; times
/// are the caller's, in seconds, and never decrease.
class EmulatedNode {
 public:
  using MakePlant = std::function<std::unique_ptr<FaultyPlant>(std::uint64_t session)>;

  EmulatedNode(MakePlant make_plant, const Calibration& calibration, SwitchPattern known_coils);

  /// Takes a valid packet; the answer, if it asks for one.
  std::optional<NodePacket> take(const NodePacket& packet, double now_s);
  /// At least once a millisecond: lets the plant's time pass and watches over the commands.
  void tick(double now_s);

  bool open() const { return plant_ != nullptr; }
  double session_time_s(double now_s) const { return now_s - opened_s_; }
  const Command& outputs() const { return plant_->outputs(); }
  const NodeLog& log() const { return log_; }

 private:
  void begin_session(const NodePacket& packet, double now_s);
  void command(const NodePacket& packet, double now_s);
  void make_safe(double now_s, const char* why);
  NodePacket sample(const NodePacket& asked, double now_s);
  void advance(double now_s);
  void event(double now_s, std::string what);

  MakePlant make_plant_;
  Calibration calibration_;
  SwitchPattern known_coils_;
  std::unique_ptr<FaultyPlant> plant_;
  NodeLog log_;
  Measurement sensors_;
  std::uint32_t session_ = 0, newest_ = 0, newest_command_ = 0, answers_ = 0;
  double opened_s_ = 0.0, last_command_s_ = 0.0, now_s_ = 0.0;
  std::int32_t session_timeouts_ = 0, session_refused_ = 0;
  bool safe_ = true, commanded_ = false;
};

}  // namespace solenoid
