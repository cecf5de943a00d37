#include "experiments/rig/emulator.hpp"

#include "core/rt/clock.hpp"
#include "core/rt/process_setup.hpp"
#include "core/system/description.hpp"
#include "experiments/base/files.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <map>
#include <random>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace solenoid {
namespace {

/// A socket on the loopback interface alone.
class Socket final : public NodePort {
 public:
  explicit Socket(int port) : file_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    const sockaddr_in at = address({INADDR_LOOPBACK, static_cast<std::uint16_t>(port)});
    if (file_ < 0 || ::bind(file_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0) {
      const std::string why = std::strerror(errno);
      if (file_ >= 0) ::close(file_);
      throw OutputError(fmt::format("127.0.0.1:{}: cannot be listened on: {}", port, why));
    }
    const int count = 1;
    ::setsockopt(file_, SOL_SOCKET, SO_RXQ_OVFL, &count, sizeof count);
  }
  ~Socket() override { ::close(file_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  double now_s() override { return clock_.now_s(); }
  std::optional<std::string_view> receive(NodePeer& from) override {
    sockaddr_in sender{};
    iovec room{bytes_.data(), bytes_.size()};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(std::uint32_t))> control;
    msghdr message{&sender, sizeof sender, &room, 1, control.data(), control.size(), 0};
    const ssize_t size = ::recvmsg(file_, &message, MSG_DONTWAIT);
    if (size < 0) return std::nullopt;
    if (const cmsghdr* more = CMSG_FIRSTHDR(&message); more && more->cmsg_type == SO_RXQ_OVFL)
      std::memcpy(&dropped_, CMSG_DATA(more), sizeof dropped_);
    from = {ntohl(sender.sin_addr.s_addr), ntohs(sender.sin_port)};
    return std::string_view(bytes_.data(), static_cast<std::size_t>(size));
  }
  void send(std::string_view bytes, const NodePeer& to) override {
    const sockaddr_in receiver = address(to);
    [[maybe_unused]] const ssize_t sent = ::sendto(file_, bytes.data(), bytes.size(), MSG_DONTWAIT,
                                                   reinterpret_cast<const sockaddr*>(&receiver), sizeof receiver);
  }
  void wait(double seconds) override {
    const timespec rest{0, static_cast<long>(1e9 * seconds)};
    pollfd ready{file_, POLLIN, 0};
    ::ppoll(&ready, 1, &rest, nullptr);
  }
  std::int64_t dropped() const override { return dropped_; }

 private:
  static sockaddr_in address(const NodePeer& peer) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(peer.port);
    at.sin_addr.s_addr = htonl(peer.address);
    return at;
  }

  int file_;
  std::uint32_t dropped_ = 0;  // as the newest packet told
  MonotonicClock clock_;
  std::array<char, NodePacket::most_size + 1> bytes_;  // one more than a packet has: what is too long shows
};

/// The way between node and controller, with the packets that the script loses, delays, repeats or spoils: loss and
/// jitter are of either direction, the others of the way to the controller.
class Wire final : public NodeLink {
 public:
  Wire(NodePort& port, const EmulatorSettings& settings) : port_(port), settings_(settings), random_(settings.seed) {}

  double now_s() override { return port_.now_s(); }
  std::size_t receive(std::span<char> room, NodePeer& from, double time_s) override {
    for (int lost = 0; lost < most_lost;) {
      if (const auto arrived = next_due(to_node_)) {
        from = arrived->peer;
        const std::size_t size = std::min(arrived->bytes.size(), room.size());
        std::copy_n(arrived->bytes.data(), size, room.data());
        return std::max<std::size_t>(size, 1);  // an empty packet is one that is too short
      }
      NodePeer sender;
      const auto bytes = port_.receive(sender);
      if (!bytes) return 0;
      heard_s_ = port_.now_s();
      if (happens("lost", time_s))
        ++lost;
      else
        delay(to_node_, {heard_s_, std::string(*bytes), sender}, time_s);
    }
    return 0;
  }
  void send(std::string_view packet, const NodePeer& to, double time_s) override {
    if (happens("lost", time_s)) return;
    Waiting waiting{port_.now_s(), std::string(packet), to};
    if (happens("corrupt", time_s))
      waiting.bytes[random_() % waiting.bytes.size()] ^= static_cast<char>(1 + random_() % 255);
    delay(to_controller_, waiting, time_s);
    if (happens("repeated", time_s)) delay(to_controller_, waiting, time_s);
    flush();
  }
  void flush() {
    while (const auto due = next_due(to_controller_)) port_.send(due->bytes, due->peer);
  }
  /// How long until the next packet is due, at most `rest_s`.
  double rest_s(double rest_s) {
    const double now_s = port_.now_s();
    for (const auto* queue : {&to_node_, &to_controller_})
      if (!queue->empty()) rest_s = std::min(rest_s, std::max(0.0, queue->begin()->first - now_s));
    return rest_s;
  }
  /// When a packet came last; 0: none has.
  double heard_s() const { return heard_s_; }

 private:
  static constexpr int most_lost = 32;  // in a row, before the node looks at time again
  struct Waiting {
    double due_s;
    std::string bytes;
    NodePeer peer;
  };
  using Queue = std::multimap<double, Waiting>;  // by when they are due: they may overtake each other

  bool happens(const char* kind, double time_s) {
    for (const InjectedFault& f : settings_.faults)
      if (f.target == "packets" && f.kind == kind && f.active(time_s) && uniform() < f.value) return true;
    return false;
  }
  void delay(Queue& queue, Waiting packet, double time_s) {
    for (const InjectedFault& f : settings_.faults) {
      if (f.target != "packets" || !f.active(time_s)) continue;
      if (f.kind == "late" && &queue == &to_controller_) packet.due_s += 1e-3 * f.value;
      if (f.kind == "jitter") packet.due_s += 1e-3 * f.value * uniform();
    }
    queue.emplace(packet.due_s, std::move(packet));
  }
  std::optional<Waiting> next_due(Queue& queue) {
    if (queue.empty() || queue.begin()->first > port_.now_s()) return std::nullopt;
    Waiting due = std::move(queue.begin()->second);
    queue.erase(queue.begin());
    return due;
  }
  double uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  NodePort& port_;
  const EmulatorSettings& settings_;
  std::mt19937_64 random_;
  Queue to_node_, to_controller_;
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
  Socket socket(settings.port);
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

std::string node_report(const EmulatedNode& node, const SystemDescription& system, std::int64_t dropped) {
  const NodeLog log = node.log();
  nlohmann::ordered_json json = counters_json(log.counters);
  json["dropped"] = dropped;
  json["longest_silence_ms"] = 1e3 * log.longest_silence_s;
  json["safe_after_ms"] = 1e3 * log.safe_after_s;
  if (node.begun()) {
    nlohmann::ordered_json& outputs = json["final_outputs"];
    outputs[system.switches_key] = node.outputs().switches;
    for (std::size_t i = 0; i < system.continuous.size(); ++i)
      outputs[system.continuous[i].key] = node.outputs().continuous[i];
  }
  json["events"] = nlohmann::ordered_json::array();
  for (const NodeLog::Event& e : log.events) json["events"].push_back({{"time_s", e.time_s}, {"what", e.what}});
  return json.dump(1) + "\n";
}

}  // namespace solenoid
