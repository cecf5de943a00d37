#include "experiments/rig/emulator.hpp"

#include "core/rt/clock.hpp"
#include "core/rt/process_setup.hpp"
#include "core/system/description.hpp"
#include "experiments/rig/node_socket.hpp"
#include "experiments/rig/packet_faults.hpp"

#include <algorithm>
#include <csignal>

#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

/// The way between node and controller.
class Wire final : public NodeLink {
 public:
  Wire(NodePort& port, const EmulatorSettings& settings) : port_(port), faults_(settings.faults, settings.seed) {}

  double now_s() override { return port_.now_s(); }
  std::size_t receive(std::span<char> room, NodePeer& from, double time_s) override {
    for (int lost = 0; lost < most_lost;) {
      if (const auto arrived = faults_.at_node(port_.now_s())) {
        from = arrived->peer;
        const std::size_t size = std::min(arrived->bytes.size(), room.size());
        std::copy_n(arrived->bytes.data(), size, room.data());
        return std::max<std::size_t>(size, 1);  // an empty packet is one that is too short
      }
      NodePeer sender;
      const auto bytes = port_.receive(sender);
      if (!bytes) return 0;
      heard_s_ = port_.now_s();
      if (!faults_.to_node(*bytes, sender, heard_s_, time_s)) ++lost;
    }
    return 0;
  }
  void send(std::string_view packet, const NodePeer& to, double time_s) override {
    faults_.to_controller(packet, to, port_.now_s(), time_s);
    flush();
  }
  void flush() {
    while (const auto due = faults_.at_controller(port_.now_s())) port_.send(due->bytes, due->peer);
  }
  /// How long until the next packet is due, at most `rest_s`.
  double rest_s(double rest_s) { return faults_.rest_s(port_.now_s(), rest_s); }
  /// When a packet came last; 0: none has.
  double heard_s() const { return heard_s_; }

 private:
  static constexpr int most_lost = 32;  // in a row, before the node looks at time again

  NodePort& port_;
  PacketFaults faults_;
  double heard_s_ = 0.0;
};

/// The process's own faults: it dies, crashes or stands still.
void fail_as_told(const EmulatorSettings& settings, double time_s, std::vector<bool>& done) {
  for (std::size_t i = 0; i < settings.faults.size(); ++i) {
    const InjectedFault& f = settings.faults[i];
    if (f.target != "process" || time_s < f.from_s || done[i]) continue;
    done[i] = true;
    if (f.kind == "killed") std::raise(SIGKILL);
    if (f.kind == "crashed") std::raise(SIGSEGV);
    MonotonicClock clock;
    clock.sleep_until(f.value);
  }
}

}  // namespace

void serve(EmulatedNode& node, const EmulatorSettings& settings, NodePort& port, const std::function<bool()>& stop) {
  Wire wire(port, settings);
  std::vector<bool> done(settings.faults.size());
  while (!stop()) {
    const double rest_s = node.poll(wire);
    wire.flush();
    const double now_s = port.now_s();
    if (node.begun()) fail_as_told(settings, node.time_s(now_s), done);
    if (wire.heard_s() > 0 && settings.idle_exit_s > 0 && now_s - wire.heard_s() > settings.idle_exit_s) return;
    port.wait(wire.rest_s(rest_s));
  }
}

std::int64_t serve(EmulatedNode& node, const EmulatorSettings& settings, const std::function<bool()>& stop,
                   const std::function<void(const std::string&)>& listening) {
  NodeSocket socket(settings.port);
  prepare_thread("node");
  std::string setup = "as an ordinary thread";
  if (settings.priority > 0) {
    const SetupStep step = set_fifo_priority("node", settings.priority);
    setup = step.granted ? step.what : step.what + " refused (" + step.detail + ")";
  }
  listening(setup);
  serve(node, settings, socket, stop);
  return socket.dropped();
}

nlohmann::ordered_json counters_json(const NodeCounters& c) {
  return {{"packets", c.packets},
          {"counted", c.counted()},
          {"commands", c.commands},
          {"requests", c.requests},
          {"sessions", c.sessions},
          {"safes", c.safes},
          {"closes", c.closes},
          {"offers", c.offers},
          {"asked", c.asked},
          {"other_wires", c.other_wires},
          {"refused", c.refused},
          {"old_packets", c.old_packets},
          {"foreign_packets", c.foreign_packets},
          {"invalid_packets", c.invalid_packets},
          {"other_versions", c.other_versions},
          {"timeouts", c.timeouts}};
}

nlohmann::ordered_json outputs_json(const Command& outputs, const SystemDescription& system) {
  nlohmann::ordered_json json = {{system.switches_key, outputs.switches}};
  for (std::size_t i = 0; i < system.continuous.size(); ++i) json[system.continuous[i].key] = outputs.continuous[i];
  return json;
}

std::string node_report(const EmulatedNode& node, const SystemDescription& system, std::int64_t dropped) {
  const NodeLog log = node.log();
  nlohmann::ordered_json json = counters_json(log.counters);
  json["dropped"] = dropped;
  json["longest_silence_ms"] = 1e3 * log.longest_silence_s;
  json["safe_after_ms"] = 1e3 * log.safe_after_s;
  if (node.begun()) json["final_outputs"] = outputs_json(node.outputs(), system);
  json["events"] = nlohmann::ordered_json::array();
  for (const NodeLog::Event& e : log.events) json["events"].push_back({{"time_s", e.time_s}, {"what", e.what}});
  return json.dump(1) + "\n";
}

}  // namespace solenoid
