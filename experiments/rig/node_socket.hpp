#pragma once

#include "core/rt/clock.hpp"
#include "experiments/rig/emulator.hpp"

#include <array>

#include <netinet/in.h>

namespace solenoid {

/// A peer as the socket functions have it.
sockaddr_in socket_address(const NodePeer& peer);

/// A node's UDP socket on the loopback interface alone, and the monotonic clock.
class NodeSocket final : public NodePort {
 public:
  /// Throws OutputError if the port cannot be had.
  explicit NodeSocket(int port);
  ~NodeSocket() override;
  NodeSocket(const NodeSocket&) = delete;
  NodeSocket& operator=(const NodeSocket&) = delete;

  double now_s() override { return clock_.now_s(); }
  std::optional<std::string_view> receive(NodePeer& from) override;
  void send(std::string_view bytes, const NodePeer& to) override;
  void wait(double seconds) override { wait(seconds, -1); }
  /// Or until another file has something to read.
  void wait(double seconds, int other_file);
  std::int64_t dropped() const override { return dropped_; }

 private:
  int file_;
  std::uint32_t dropped_ = 0;  // as the newest packet told
  MonotonicClock clock_;
  std::array<char, NodePacket::most_size + 1> bytes_;  // one more than a packet has: what is too long shows
};

}  // namespace solenoid
