#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace solenoid {

/// Where a packet came from.
struct NodePeer {
  std::uint32_t address = 0;  ///< IPv4, in the host's byte order
  std::uint16_t port = 0;
  bool operator==(const NodePeer&) const = default;
};

/// What a node tells of itself; nothing depends on it.
enum class NodeEvent : std::uint8_t {
  opened,              ///< by the peer
  closed,              ///< by its controller
  safe_by_timeout,     ///< no command came in time
  safe_by_command,     ///< its controller asked for it
  safe_by_session,     ///< another controller has it now
  commanded_again,     ///< the first command after safe outputs
  refused_command,     ///< one that the outputs cannot be
  refused_controller,  ///< the peer asked while another has the node
  refused_version,     ///< the peer speaks another version of the protocol
};

/// The board that a node runs on: ten functions, all that a port has to write. Each returns at once unless it says otherwise;
/// none may be called from an interrupt.
class NodeHardware {
 public:
  /// Time since the board was started [us]: never decreases, and does not wrap.
  virtual std::uint64_t now_us() noexcept = 0;
  /// 64 bits that nobody can guess: of a generator of true random numbers. Asked for when the node starts; its sessions
  /// are as safe as these are.
  virtual std::uint64_t random() noexcept = 0;

  /// The next UDP packet that came to node_port, and who sent it: its bytes into `room`, returning how many; 0: none has come.
  /// Of a packet that is longer than `room` as much as has room, of an empty one any byte: the node ignores both.
  virtual std::size_t receive(std::span<char> room, NodePeer& from) noexcept = 0;
  /// Sends a UDP packet from node_port; may lose it.
  virtual void send(std::span<const char> bytes, const NodePeer& to) noexcept = 0;

  /// One conversion of every input, in counts of the converter (NodeDescription::inputs makes volts of them).
  virtual void convert(std::span<std::int32_t> counts) noexcept = 0;
  /// Sets every switch: bit s is switch s.
  virtual void set_switches(std::uint32_t pattern) noexcept = 0;
  /// Sets one continuous output [uV].
  virtual void set_output(std::size_t index, std::int32_t microvolts) noexcept = 0;

  /// Feeds the independent watchdog, which resets the board, outputs safe, if this is not called for 20 ms.
  virtual void kick_watchdog() noexcept = 0;
  /// Rests for so long at most, or until a packet has come.
  virtual void wait(std::uint32_t microseconds) noexcept = 0;
  /// Tells a person: a lamp, a serial line, a log.
  virtual void tell(NodeEvent event, const NodePeer& peer) noexcept = 0;

 protected:
  ~NodeHardware() = default;
};

}  // namespace solenoid
