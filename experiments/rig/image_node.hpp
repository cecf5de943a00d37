#pragma once

#include "experiments/rig/calibration.hpp"
#include "experiments/rig/emulator.hpp"
#include "experiments/rig/faulty_plant.hpp"
#include "experiments/rig/image_bridge.hpp"
#include "experiments/rig/node_socket.hpp"
#include "experiments/rig/packet_faults.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace solenoid {

/// The firmware's image in the place of the emulated node: the node runs on QEMU's board, the plant here. The board's
/// converters are written eight times a millisecond, and what its outputs have become reaches the plant as soon as it
/// is seen.
class ImageNode {
 public:
  /// As EmulatedNode; starts the board and binds 127.0.0.1:`settings.port`. Throws ConfigError, OutputError.
  ImageNode(std::unique_ptr<FaultyPlant> plant, const Calibration& calibration, const NodeDescription& description,
            const EmulatorSettings& settings, const ImageSettings& image);

  /// Serves controllers in real time until `stop()`, or until the settings' idle_exit_s.
  void serve(const std::function<bool()>& stop);

  /// What reached the plant.
  const Command& outputs() const { return plant_->outputs(); }
  /// Whether the plant's time has begun: with the first session.
  bool begun() const { return begun_s_ >= 0.0; }
  /// When it has, by the wall clock [ns].
  std::int64_t begun_ns() const { return begun_ns_; }
  ImageBoard& board() { return board_; }
  const ImageBoard& board() const { return board_; }
  ImageBridge& bridge() { return bridge_; }
  /// Packets that the operating system had no room for, on their way to the node.
  std::int64_t dropped() const { return socket_.dropped(); }

 private:
  void pass_packets();
  void step(double now_s);
  void write_converters();
  void read_outputs();
  void fail_as_told(double now_s);
  double time_s(double now_s) const { return begun() ? now_s - begun_s_ : 0.0; }

  std::unique_ptr<FaultyPlant> plant_;
  Calibration calibration_;
  EmulatorSettings settings_;
  NodeSocket socket_;
  PacketFaults faults_;
  ImageBoard board_;
  ImageBridge bridge_;
  std::vector<bool> done_;
  Measurement sensors_;
  std::uint32_t changes_ = 0;
  std::int64_t begun_ns_ = 0;
  double begun_s_ = -1.0, heard_s_ = 0.0, due_s_ = 0.0, goes_on_s_ = -1.0;
};

/// Serves it as a real-time thread, if the system grants one; as serve does an emulated node.
void serve(ImageNode& node, const EmulatorSettings& settings, const std::function<bool()>& stop,
           const std::function<void(const std::string&)>& listening);

/// What the image and its board have seen, as JSON: node_report's keys, and what only a board has. Times are the
/// image's own.
std::string image_report(const ImageNode& node, const SystemDescription& system);

}  // namespace solenoid
