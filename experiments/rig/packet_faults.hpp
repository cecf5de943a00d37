#pragma once

#include "experiments/rig/fault_script.hpp"
#include "experiments/rig/node/hardware.hpp"

#include <map>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// The way between node and controller, with the packets that a script loses, delays, repeats or spoils: loss and
/// jitter are of either direction, the others of the way to the controller. Moments are of the caller's clock, `time_s`
/// is the plant's.
class PacketFaults {
 public:
  /// A packet on its way, and who sent it or is to have it.
  struct Packet {
    std::string bytes;
    NodePeer peer;
  };

  PacketFaults(std::vector<InjectedFault> faults, std::uint64_t seed) : faults_(std::move(faults)), random_(seed) {}

  /// Takes a packet to the node; false: it is lost.
  bool to_node(std::string_view bytes, const NodePeer& from, double now_s, double time_s);
  /// Takes a packet from the node.
  void to_controller(std::string_view bytes, const NodePeer& to, double now_s, double time_s);
  /// The next packet that has arrived at the node.
  std::optional<Packet> at_node(double now_s) { return next_due(to_node_, now_s); }
  /// The next packet that has arrived at its controller.
  std::optional<Packet> at_controller(double now_s) { return next_due(to_controller_, now_s); }
  /// How long until the next one arrives, at most `rest_s`.
  double rest_s(double now_s, double rest_s) const;

 private:
  using Queue = std::multimap<double, Packet>;  // by when they are due: they may overtake each other

  bool happens(std::string_view kind, double time_s);
  void delay(Queue& queue, double due_s, Packet packet, double time_s);
  static std::optional<Packet> next_due(Queue& queue, double now_s);
  double uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  std::vector<InjectedFault> faults_;
  std::mt19937_64 random_;
  Queue to_node_, to_controller_;
};

}  // namespace solenoid
