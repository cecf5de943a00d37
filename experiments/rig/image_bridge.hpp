#pragma once

#include "experiments/rig/image_board.hpp"
#include "experiments/rig/node/ports/network.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace solenoid {

/// The cable and the network between controllers on this computer and the board: what comes for the node in UDP packets
/// becomes Ethernet frames, and back. A controller at 127.0.0.1 is 10.0.2.2 to the node, 127.0.0.2 is 10.0.2.3 and so
/// on, with the port that it has.
class ImageBridge {
 public:
  static constexpr std::uint32_t node_address = 10u << 24 | 2u << 8 | 15u;  ///< 10.0.2.15
  static constexpr MacAddress own_mac{0x52, 0x55, 0x0a, 0x00, 0x02, 0x02};

  explicit ImageBridge(ImageBoard& board) : board_(board) {}

  /// Asks the board for its Ethernet address. Throws OutputError if it does not answer.
  void find();
  /// What it answered.
  const MacAddress& mac() const { return mac_; }

  /// A UDP packet of somebody on this computer, to the node.
  void send(std::string_view bytes, const NodePeer& from);
  /// A UDP packet of the node: its bytes, valid until the next call, and who on this computer it is for. None: there is
  /// none now.
  struct Received {
    std::string_view bytes;
    NodePeer to;
  };
  std::optional<Received> receive();

  /// A frame to the board's Ethernet address with this type and content.
  std::string frame(std::uint16_t type, std::string_view content) const;
  /// An IPv4 packet in a frame to the board.
  std::string ip_frame(std::uint8_t protocol, std::uint32_t from, std::string_view content) const;
  /// A UDP packet in such a frame, from an address of the board's network.
  std::string udp_frame(const NodePeer& from, std::uint16_t to_port, std::string_view content) const;

 private:
  ImageBoard& board_;
  MacAddress mac_{0xff, 0xff, 0xff, 0xff, 0xff, 0xff};
};

/// The address on the board's network of one on this computer.
constexpr std::uint32_t address_beyond(std::uint32_t loopback) {
  return (10u << 24 | 2u << 8 | 1u) + (loopback & 0xffffffu);
}
/// The other way.
constexpr std::uint32_t address_here(std::uint32_t beyond) {
  return 127u << 24 | ((beyond - (2u << 8 | 1u)) & 0xffffffu);
}

}  // namespace solenoid
