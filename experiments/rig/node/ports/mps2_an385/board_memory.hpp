#pragma once

#include "experiments/rig/node/node.hpp"

#include <cstddef>
#include <cstdint>

namespace solenoid {

/// What the host and the image on QEMU's board share: the machine's 16 MB of PSRAM, which the host maps too. It stands
/// in for the converters, switches and amplifiers that the emulated board does not have, and for the flash in which a
/// real one keeps its wire text, calibration and key. Fixed widths at the same offsets on both sides; whoever is said
/// to write a member is the only one.
struct BoardMemory {
  static constexpr std::uint32_t address = 0x21000000;  ///< on the board
  static constexpr std::uint32_t size = 16u << 20;
  static constexpr std::uint32_t known = 0x344D4E53;  ///< "SNM4"
  static constexpr std::size_t most_wire = NodePacket::most_payload;

  /// What the node is: the host, before the board is started.
  struct Description {
    std::uint32_t magic;  ///< known: the host has filled it in
    std::uint32_t wire_size, channels, outputs, switches, safe_switches;
    std::uint32_t period_us, conversions;
    std::uint32_t has_key;
    char wire[most_wire];
    unsigned char key[16];
    unsigned char seed[16];  ///< of the numbers that nobody can guess
    NodeOutput continuous[most_node_outputs];
    NodeInput inputs[most_node_channels];
  } description;

  /// The converters: the host, all the time. And faults of the node itself, which the host asks for.
  struct FromHost {
    std::int32_t counts[most_node_channels];
    std::uint32_t hang;     ///< the node's loop stops; reset by the board when it starts
    std::uint32_t stop_us;  ///< it stands still for so long; reset by the board when it has
  } from_host;

  /// The outputs: the image, when they change.
  struct Outputs {
    std::uint32_t changes;  ///< how often any was set
    std::uint32_t switches;
    std::int32_t microvolts[most_node_outputs];
    std::uint64_t changed_us;  ///< the board's clock when one was set last
  } outputs;

  /// What the image says of itself, every half second and at each event; `writing` is odd meanwhile.
  struct Report {
    std::uint32_t writing;
    std::uint32_t stack_bytes;  ///< the most that was used, since power on
    std::uint64_t now_us;       ///< since the board was started, or reset
    std::uint64_t last_command_us;
    std::uint32_t safe;
    std::uint32_t conversions;                      ///< asked of the converters
    NodeCounters counters;                          ///< since it was started, or reset
    std::uint32_t watchdog_kicks, frames, answers;  ///< frames that came, and that were sent
    std::uint32_t longest_gap_us;                   ///< between two feedings of the watchdog
  } report;

  /// What a reset leaves as it is: the image.
  struct Lasting {
    std::uint32_t boots;            ///< starts: power on, and resets
    std::uint32_t watchdog_resets;  ///< that the watchdog warned of, by its first expiry
    std::uint32_t faults;           ///< the processor's own: an address that is not there, an instruction that is none
    std::uint32_t random_numbers;   ///< made with the seed
    std::uint64_t safe_us;          ///< the clock when the watchdog made the outputs safe last
    std::uint64_t before_us;        ///< and that of the last command before that
  } lasting;
};

static_assert(alignof(BoardMemory) == 8 && sizeof(BoardMemory) <= BoardMemory::size);
static_assert(offsetof(BoardMemory, outputs) % 8 == 0 && offsetof(BoardMemory, report) % 8 == 0);

}  // namespace solenoid
