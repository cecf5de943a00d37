#include "experiments/rig/node/ports/mps2_an385/board.hpp"
#include "experiments/rig/node/ports/mps2_an385/stack.hpp"

#include <array>
#include <cstdint>
#include <new>

using solenoid::mps2::memory;

// Of the linker script.
extern "C" {
extern std::uint32_t stack_bottom[], stack_top[], data_begin[], data_end[], bss_begin[], bss_end[];
extern const std::uint32_t data_image[];
}

namespace solenoid::mps2 {
namespace {

/// The node and its board stay where they are put: no exit runs their destructors, and no guard their constructors.
alignas(Board) char board_room[sizeof(Board)];
alignas(Node) char node_room[sizeof(Node)];
NodeDescription description;
NodeKey key;

/// As the flash of a real board has it; here the host has written it.
void read_description() {
  volatile BoardMemory::Description& in = memory().description;
  // The host does not change it while the board is on: as good as constant from here.
  description.wire = {const_cast<const char*>(in.wire), std::uint32_t{in.wire_size}};
  if (in.has_key != 0) {
    for (std::size_t i = 0; i < key.bytes.size(); ++i) key.bytes[i] = in.key[i];
    description.key = &key;
  }
  description.channels = in.channels;
  description.outputs = in.outputs;
  description.switches = in.switches;
  description.safe_switches = in.safe_switches;
  for (std::size_t i = 0; i < most_node_channels; ++i) {
    description.inputs[i].offset_microvolts = in.inputs[i].offset_microvolts;
    description.inputs[i].scale = in.inputs[i].scale;
  }
  for (std::size_t i = 0; i < most_node_outputs; ++i) {
    description.continuous[i].most_microvolts = in.continuous[i].most_microvolts;
    description.continuous[i].safe_microvolts = in.continuous[i].safe_microvolts;
  }
  description.sampling.period_us = in.period_us;
  description.sampling.conversions = in.conversions;
}

bool possible() {
  volatile BoardMemory::Description& in = memory().description;
  return in.magic == BoardMemory::known && in.wire_size <= BoardMemory::most_wire &&
         in.channels <= most_node_channels && in.outputs <= most_node_outputs && in.period_us != 0 &&
         in.conversions != 0;
}

[[noreturn]] void live() {
  while (!possible()) __asm__ volatile("wfi");  // nothing to be a node of
  read_description();
  Board& board = *new (board_room) Board;
  board.start();
  Node& node = *new (node_room) Node(description, board);
  node.start();
  for (;;) {
    node.run_once();
    board.report(node);
  }
}

}  // namespace

std::uint32_t most_stack_used() noexcept {
  const std::uint32_t* lowest = stack_bottom;
  while (lowest < stack_top && *lowest == stack_paint) ++lowest;
  return static_cast<std::uint32_t>(4 * (stack_top - lowest));
}

}  // namespace solenoid::mps2

extern "C" {

/// Where the processor begins: safe outputs before anything else. Nothing here may need what is not there yet, and
/// interrupts stay masked for good.
[[noreturn]] void start() {
  __asm__ volatile("cpsid i" ::: "memory");
  solenoid::mps2::make_outputs_safe();
  memory().lasting.boots = memory().lasting.boots + 1;
  std::uint32_t here;
  __asm__ volatile("mov %0, sp" : "=r"(here));
  constexpr std::uint32_t own_frame = 64;
  for (std::uint32_t* at = stack_bottom; reinterpret_cast<std::uint32_t>(at) < here - own_frame; ++at)
    *static_cast<volatile std::uint32_t*>(at) = solenoid::mps2::stack_paint;
  const std::uint32_t* from = data_image;
  for (std::uint32_t* to = data_begin; to < data_end; ++to) *to = *from++;
  for (std::uint32_t* at = bss_begin; at < bss_end; ++at) *at = 0;
  solenoid::mps2::live();
}

/// The watchdog's first expiry is the non-maskable interrupt.
[[noreturn]] void on_watchdog() { solenoid::mps2::watchdog_bites(); }
[[noreturn]] void on_fault() { solenoid::mps2::processor_fails(); }
}

/// Of the processor's exceptions (Arm DDI 0403, B1.5.2): the stack, the beginning, and what to do with the rest.
union Vector {
  std::uint32_t* stack;
  void (*handler)();
};
constexpr std::size_t exceptions = 16, interrupts = 32;
extern const std::array<Vector, exceptions + interrupts> vectors;
__attribute__((section(".vectors"), used)) constexpr std::array<Vector, exceptions + interrupts> vectors = [] {
  std::array<Vector, exceptions + interrupts> table{};
  for (Vector& vector : table) vector.handler = on_fault;
  table[0].stack = stack_top;
  table[1].handler = start;
  table[2].handler = on_watchdog;
  return table;
}();
