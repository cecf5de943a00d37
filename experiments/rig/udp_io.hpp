#pragma once

#include "core/metrics/percentile_sketch.hpp"
#include "core/rt/clock.hpp"
#include "experiments/rig/node_clock.hpp"
#include "experiments/rig/node_protocol.hpp"
#include "experiments/rig/rig_io.hpp"

#include <array>
#include <atomic>
#include <optional>
#include <string>

namespace solenoid {

/// How to reach an I/O node.
struct UdpSettings {
  std::string address = "127.0.0.1";
  int port = node_port;
  std::optional<NodeKey> key;
  double wait_s = 400e-6;                  ///< a read waits so long for its sample: two fifths of a tick of 1 ms
  double most_age_s = 5e-3;                ///< an older one is none: five ticks
  double open_wait_s = 3.0;                ///< open repeats its packets for so long,
  double busy_wait_s = 1.5 * node_hold_s;  ///< or, if another controller has the node, which may just have died
  std::string text() const;                ///< "127.0.0.1:47811"
};
/// Its times for a loop's tick: two fifths of it to wait, five of them, or 40 ms, for the greatest age.
UdpSettings timed_for(UdpSettings settings, double tick_s);

/// "ADDRESS:PORT". Throws ConfigError.
UdpSettings parse_node_address(const std::string& text);

/// Whether packets stay on this computer.
bool on_loopback(const UdpSettings& settings);

/// What is on the wire: both sides must agree on it.
struct NodeWire {
  std::string text;  ///< wire_text()
  std::size_t channels = 0, continuous = 0;
};

/// The controller's side of the UDP I/O node. Each read asks for a sample and returns the newest that has arrived: the
/// answer to this very request if it comes within a fraction of the tick, else one to an earlier request, with its age
/// by the node's clock (node_clock.hpp). Answers that were overtaken, repeated or are too old are counted and serve
/// nothing. On a wire whose answers mostly take longer than a read waits, it does not wait where something new is
/// there.
class UdpIo final : public RigIo {
 public:
  UdpIo(const UdpSettings& settings, NodeWire wire) : settings_(settings), wire_(std::move(wire)) {}
  ~UdpIo() override;
  UdpIo(const UdpIo&) = delete;
  UdpIo& operator=(const UdpIo&) = delete;

  /// Throws OutputError if no node answers, or it says that another controller has it; ConfigError if it is another
  /// system's.
  void open() override;
  RigInputs read() noexcept override;
  void write(const RigOutputs& outputs) noexcept override;
  void safe() noexcept override;
  IoHealth health() const noexcept override;
  void watch_anew() noexcept override;

 private:
  void connect();
  /// The session that the node offers, within a short time; none if it does not answer or refuses (`refusal_`).
  std::optional<std::uint64_t> ask_for_session();
  const NodeKey* key() const { return settings_.key ? &*settings_.key : nullptr; }
  bool send(NodePacket& packet) noexcept;
  /// The next valid packet that has arrived, and when it did (`arrived_s_`), which may be long before it is read.
  std::optional<NodePacket> receive() noexcept;
  /// Takes what has arrived; whether the answer to `sequence` is among it.
  bool drain(std::uint64_t sequence) noexcept;
  void take(const NodeSample& sample, std::uint64_t node_time_us) noexcept;
  /// Whether the node's time may be believed.
  bool note_answer(std::uint64_t echo, std::uint64_t node_time_us) noexcept;
  void note_request(std::uint64_t sequence) noexcept;
  /// Whether the newest sample is newer than at the last read and young enough.
  bool fresh_at(double now_s) const noexcept;
  void wait(double until_s) noexcept;
  bool wait_for_sample(std::uint64_t sequence, double wait_s) noexcept;

  /// A request under way.
  struct Request {
    std::uint64_t sequence = 0;
    double sent_s = 0.0;
    bool answered = true;
  };

  UdpSettings settings_;
  NodeWire wire_;
  MonotonicClock clock_;
  int socket_ = -1;
  std::atomic<std::uint64_t> sequence_ = 0;  // a crash handler counts too
  std::uint64_t session_ = 0, asked_with_ = 0, newest_echo_ = 0, seen_us_ = 0, measured_us_ = 0;
  std::int32_t timeouts_seen_ = 0;
  std::string refusal_;
  char other_version_ = 0;  // that a node speaks, which no packet can be read of
  RigInputs inputs_;
  IoHealth health_;
  NodeClock node_clock_;
  std::array<Request, 64> requests_{};  // in turn
  std::size_t next_request_ = 0;
  double arrived_s_ = 0.0;
  bool newer_ = false;  // than at the last read
  PercentileSketch round_trips_us_, ages_us_;
  WireHealth wire_health_;
  double share_late_ = 0.0;  // of the last answers
};

}  // namespace solenoid
