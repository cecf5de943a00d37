#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace solenoid {

/// Sits on the wire between a controller and a node, both on 127.0.0.1: forwards every packet at once, keeps the newest
/// of the controller's, and can put in packets of its own that come from the controller's address.
class PacketTap {
 public:
  /// Controllers reach the node at `front_port`. Throws OutputError if a port cannot be had.
  PacketTap(int front_port, int node_port);
  ~PacketTap();
  PacketTap(const PacketTap&) = delete;
  PacketTap& operator=(const PacketTap&) = delete;

  /// The controller's newest packets, the oldest first.
  std::vector<std::string> recorded() const;
  /// The newest of them; empty: there is none.
  std::string newest() const;
  /// The node's time in the newest of its packets [us].
  std::uint64_t node_time_us() const { return node_time_us_; }
  /// Sends bytes to the node as if from the controller; returns whether they were sent.
  bool inject(const std::string& bytes) const;
  std::int64_t forwarded() const { return forwarded_; }  ///< of the controller's
  std::int64_t commands() const { return commands_; }    ///< among them

 private:
  void forward();
  void keep(const char* bytes, std::size_t size);

  int front_ = -1, back_ = -1;
  std::atomic<bool> ended_ = false;
  std::atomic<std::int64_t> forwarded_ = 0, commands_ = 0;
  std::atomic<std::uint64_t> node_time_us_ = 0;
  mutable std::mutex mutex_;
  std::vector<std::string> newest_;
  std::size_t next_ = 0;
  std::thread thread_;
};

/// A UDP socket on 127.0.0.1, at a port or at any (0), sending to another port of it. Throws OutputError.
int loopback_socket(int at_port, int to_port);

}  // namespace solenoid
