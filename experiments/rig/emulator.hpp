#pragma once

#include "experiments/rig/emulated_node.hpp"

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace solenoid {

/// The emulator's process: where it listens, and how its packets and itself fail.
struct EmulatorSettings {
  int port = node_port;
  std::vector<InjectedFault> faults;  ///< packets and process; the plant has its own
  std::uint64_t seed = 1;
  double idle_exit_s = 0.0;  ///< ends after so long without a packet, once one has come; 0: never
  int priority = 85;         ///< SCHED_FIFO; 0: as it is
};

/// Where the node's loop takes packets and answers them, and the time it does: a socket and the monotonic clock, or
/// what a test makes of them.
class NodePort {
 public:
  virtual ~NodePort() = default;
  virtual double now_s() = 0;
  /// The next packet's bytes, valid until the next call, and who sent it; none: nothing has come.
  virtual std::optional<std::string_view> receive(NodePeer& from) = 0;
  virtual void send(std::string_view bytes, const NodePeer& to) = 0;
  virtual void wait(double seconds) = 0;  ///< at most so long, or until a packet has come
  /// Packets that came and that there was no room for.
  virtual std::int64_t dropped() const { return 0; }
};

/// Serves the node on a port until `stop()`.
void serve(EmulatedNode& node, const EmulatorSettings& settings, NodePort& port, const std::function<bool()>& stop);

/// Serves the node on 127.0.0.1 in real time until `stop()`. Throws OutputError if the port cannot be had.
/// `listening` is called once it can be reached. Returns how many packets the operating system had no room for.
std::int64_t serve(EmulatedNode& node, const EmulatorSettings& settings, const std::function<bool()>& stop,
                   const std::function<void(const std::string&)>& listening);

/// A node's counters by their names.
nlohmann::ordered_json counters_json(const NodeCounters& counters);

/// Outputs of a system's node by their names.
nlohmann::ordered_json outputs_json(const Command& outputs, const SystemDescription& system);

/// What the node of a system has seen, as JSON; `dropped`: packets that did not come to it.
std::string node_report(const EmulatedNode& node, const SystemDescription& system, std::int64_t dropped);

}  // namespace solenoid
