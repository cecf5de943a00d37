#pragma once

#include "core/rt/clock.hpp"
#include "experiments/rig/node_protocol.hpp"
#include "experiments/rig/rig_io.hpp"

#include <string>

#include <netinet/in.h>

namespace solenoid {

/// How to reach an I/O node.
struct UdpSettings {
  std::string address = "127.0.0.1";
  int port = node_port;
  double wait_s = 400e-6;    ///< a read waits so long for its sample
  double open_wait_s = 3.0;  ///< open repeats its packet for so long
};
/// "ADDRESS:PORT". Throws ConfigError.
UdpSettings parse_node_address(const std::string& text);

/// The controller's side of the UDP I/O node. Each read asks for a sample and waits for the answer to this very
/// request; an answer that comes too late counts as late and serves as the last value.
class UdpIo final : public RigIo {
 public:
  explicit UdpIo(const UdpSettings& settings) : settings_(settings) {}
  ~UdpIo() override;
  UdpIo(const UdpIo&) = delete;
  UdpIo& operator=(const UdpIo&) = delete;

  void open() override;
  RigInputs read() noexcept override;
  void write(const RigOutputs& outputs) noexcept override;
  void safe() noexcept override;
  IoHealth health() const noexcept override { return health_; }

 private:
  bool send(NodePacket::Type type, const std::array<std::int32_t, 6>& words) noexcept;
  /// Takes what has arrived; whether the sample of `sequence` was among it.
  bool receive(std::uint32_t sequence) noexcept;
  bool wait_for_sample(std::uint32_t sequence, double wait_s) noexcept;

  UdpSettings settings_;
  MonotonicClock clock_;
  int socket_ = -1;
  std::uint32_t session_ = 0, sequence_ = 0, newest_echo_ = 0;
  std::int32_t timeouts_seen_ = 0;
  RigInputs inputs_;
  IoHealth health_;
};

}  // namespace solenoid
