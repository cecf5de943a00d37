#pragma once

#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"
#include "experiments/rig/node/ports/mps2_an385/board_memory.hpp"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// What an image is started with.
struct ImageSettings {
  std::string file;  ///< the node's image, an ELF file; empty: the one that was built with this program
  int priority = 0;  ///< SCHED_FIFO of the emulated processor, if the system grants it; 0: none is asked for
};

/// The image that was built beside this program. Throws ConfigError naming what to install where there is none.
std::string built_image();

/// QEMU's program for the board. Throws ConfigError with the name of its package where there is none.
std::string board_emulator();

/// A node's description as the board's memory has it; its random seed is drawn. Throws ConfigError for one that has no
/// room.
BoardMemory::Description description_in_memory(const NodeDescription& description);

/// The node's image on a board of QEMU's, mps2-an385, which runs as a process of its own, in real time, and ends with
/// the object. Its converters, outputs and calibration are memory that both map; Ethernet frames go through a pair of
/// sockets; its serial line writes a file.
class ImageBoard {
 public:
  /// Throws ConfigError for what is missing, OutputError if QEMU cannot be started.
  ImageBoard(const ImageSettings& settings, const BoardMemory::Description& description);
  ~ImageBoard();
  ImageBoard(const ImageBoard&) = delete;
  ImageBoard& operator=(const ImageBoard&) = delete;

  /// Waits until the image's first report; OutputError with what QEMU said if none comes.
  void wait_for_start();

  volatile BoardMemory& memory() { return *memory_; }
  const volatile BoardMemory& memory() const { return *memory_; }
  /// The image's newest report, whole.
  BoardMemory::Report report() const;
  /// What it said on its serial line so far.
  std::string serial() const;

  /// A frame from the board; none: there is none now.
  std::optional<std::string_view> receive();
  /// A frame to the board; may be lost, as frames may.
  void send(std::string_view frame);
  /// To be polled for frames from the board.
  int frames() const { return frames_; }
  Child& process() { return *process_; }

 private:
  TemporaryFolder folder_;
  volatile BoardMemory* memory_ = nullptr;
  int frames_ = -1;
  std::vector<char> frame_;
  std::unique_ptr<Child> process_;
};

}  // namespace solenoid
