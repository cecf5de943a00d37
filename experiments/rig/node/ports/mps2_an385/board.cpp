#include "experiments/rig/node/ports/mps2_an385/board.hpp"

#include "experiments/rig/node/bytes.hpp"
#include "experiments/rig/node/ports/mps2_an385/registers.hpp"
#include "experiments/rig/node/ports/mps2_an385/stack.hpp"
#include "experiments/rig/node/tag.hpp"

#include <algorithm>
#include <cstring>

namespace solenoid::mps2 {
namespace {

constexpr int most_strange_frames = 8;  // looked at in one call: pings, requests for the address, what is nobody's
constexpr std::uint32_t longest_rest_us = 100'000;
constexpr std::uint32_t watchdog_interrupts_and_resets = 3;

/// Of NodeEvent, in its order.
constexpr std::array<std::string_view, 9> event_texts = {
    "opened by",          "closed by",          "safe by timeout of", "safe by command of", "safe by another session:",
    "commanded again by", "refused command of", "refused controller", "refused version of"};

/// A reset, and nothing else.
[[noreturn]] void reset() noexcept {
  at(cpu::reset_control) = cpu::reset_now;
  for (;;) __asm__ volatile("dsb");
}

/// A number that the host reads while it may be written.
void add_one(volatile std::uint32_t& counter) noexcept { counter = counter + 1; }

}  // namespace

void make_outputs_safe() noexcept {
  volatile BoardMemory& shared = memory();
  if (shared.description.magic != BoardMemory::known) return;
  shared.outputs.switches = shared.description.safe_switches;
  for (std::size_t i = 0; i < most_node_outputs; ++i)
    shared.outputs.microvolts[i] = shared.description.continuous[i].safe_microvolts;
  add_one(shared.outputs.changes);
}

void watchdog_bites() noexcept {
  make_outputs_safe();
  memory().lasting.safe_us = at(counter);
  memory().lasting.before_us = memory().report.last_command_us;
  add_one(memory().lasting.watchdog_resets);
  reset();
}

void processor_fails() noexcept {
  make_outputs_safe();
  add_one(memory().lasting.faults);
  reset();
}

void Board::start() noexcept {
  at(prescale) = clock_mhz - 1;
  at(counter) = 0;
  at(watchdog_load) = watchdog_us * clock_mhz;
  at(watchdog_control) = watchdog_interrupts_and_resets;
  memory().from_host.hang = 0;
  memory().from_host.stop_us = 0;
  line_.start();
  const bool online = chip_.start();
  network_ = Network({chip_.mac(), ip_address, udp_port});
  at(cpu::interrupt_enable) = 1u << ethernet_interrupt;
  line_.add("node: start ");
  line_.add(memory().lasting.boots);
  if (!online) line_.add(", without its Ethernet chip");
  line_.add(", UDP port ");
  line_.add(std::uint32_t{udp_port});
  line_.add("\n");
}

std::uint64_t Board::now_us() noexcept {
  const std::uint32_t now = at(counter);
  if (now < counted_) ++wraps_;  // each 71 minutes; the loop looks far more often
  counted_ = now;
  return std::uint64_t{wraps_} << 32 | now;
}

/// The emulated board has no generator of true random numbers. The host puts 128 random bits into its memory, and the
/// numbers are SipHash-2-4 of a counter under them, which no reset sets back. A real board must use its own generator
/// (STM32: RNG, RM0090 24; RP2040: ROSC.RANDOMBIT, conditioned) and check its health, or sessions can be guessed.
std::uint64_t Board::random() noexcept {
  NodeKey seed;
  for (std::size_t i = 0; i < seed.bytes.size(); ++i) seed.bytes[i] = memory().description.seed[i];
  std::array<char, 4> counted;
  add_one(memory().lasting.random_numbers);
  put_little_endian(counted.data(), static_cast<std::uint32_t>(memory().lasting.random_numbers));
  return take_little_endian<std::uint64_t>(siphash_2_4_128({counted.data(), counted.size()}, seed).data());
}

std::size_t Board::receive(std::span<char> room, NodePeer& from) noexcept {
  for (int i = 0; i < most_strange_frames && chip_.has_frame(); ++i) {
    const std::size_t size = chip_.receive(frame_);
    if (size == 0) continue;
    add_one(memory().report.frames);
    const auto taken = network_.take({reinterpret_cast<const char*>(frame_.data()), size}, answer_);
    if (!taken.answer.empty()) chip_.send(taken.answer);
    if (!taken.from || taken.payload.empty()) continue;
    from = *taken.from;
    const std::size_t kept = std::min(taken.payload.size(), room.size());
    std::memcpy(room.data(), taken.payload.data(), kept);
    return kept;
  }
  return 0;
}

void Board::send(std::span<const char> bytes, const NodePeer& to) noexcept {
  const auto frame = network_.make(bytes, to, answer_);
  if (frame.empty()) return;
  add_one(memory().report.answers);
  chip_.send(frame);
}

void Board::convert(std::span<std::int32_t> counts) noexcept {
  for (std::size_t i = 0; i < counts.size() && i < most_node_channels; ++i) counts[i] = memory().from_host.counts[i];
  add_one(memory().report.conversions);
}

void Board::set_switches(std::uint32_t pattern) noexcept {
  if (memory().outputs.switches == pattern) return;
  memory().outputs.switches = pattern;
  memory().outputs.changed_us = now_us();
  add_one(memory().outputs.changes);
}

void Board::set_output(std::size_t index, std::int32_t microvolts) noexcept {
  if (index >= most_node_outputs || memory().outputs.microvolts[index] == microvolts) return;
  memory().outputs.microvolts[index] = microvolts;
  memory().outputs.changed_us = now_us();
  add_one(memory().outputs.changes);
}

void Board::kick_watchdog() noexcept {
  while (memory().from_host.hang != 0) {  // a loop that never ends, as the host wants it
  }
  if (const std::uint32_t still_us = memory().from_host.stop_us; still_us != 0) stand_still(still_us);
  at(watchdog_clear) = 1;
  const std::uint64_t now = now_us();
  const std::uint32_t gap_us = static_cast<std::uint32_t>(now - fed_us_);
  if (fed_us_ != 0 && gap_us > memory().report.longest_gap_us) memory().report.longest_gap_us = gap_us;
  fed_us_ = now;
  add_one(memory().report.watchdog_kicks);
}

void Board::stand_still(std::uint32_t microseconds) noexcept {
  memory().from_host.stop_us = 0;
  for (const std::uint64_t until = now_us() + microseconds; now_us() < until;) {
  }
}

/// Interrupts are masked: what is pending ends the rest (Arm DDI 0403, B1.5.19), and its handler is not called.
void Board::wait(std::uint32_t microseconds) noexcept {
  line_.poll(now_us());
  if (microseconds == 0) return;
  chip_.wake(true);
  if (!chip_.has_frame()) {
    at(cpu::systick_reload) = std::min(microseconds, longest_rest_us) * clock_mhz - 1;
    at(cpu::systick_current) = 0;
    at(cpu::systick_control) = cpu::systick_on;
    __asm__ volatile("dsb\n\twfi\n\tisb" ::: "memory");
    at(cpu::systick_control) = 0;
  }
  chip_.wake(false);
  at(cpu::control_state) = cpu::unpend_systick;
  at(cpu::interrupt_unpend) = 1u << ethernet_interrupt;
}

void Board::tell(NodeEvent event, const NodePeer& peer) noexcept {
  const std::uint64_t now = now_us();
  const std::uint32_t milliseconds = static_cast<std::uint32_t>(now / 1000);
  line_.add(milliseconds);
  line_.add(" ms: ");
  line_.add(event_texts[static_cast<std::size_t>(event) % event_texts.size()]);
  for (int i = 3; i >= 0; --i) {
    line_.add(i == 3 ? " " : ".");
    line_.add(peer.address >> (8 * i) & 255u);
  }
  line_.add(":");
  line_.add(std::uint32_t{peer.port});
  line_.add("\n");
  report_due_us_ = 0;
}

void Board::report(const Node& node) noexcept {
  volatile BoardMemory::Report& out = memory().report;
  out.last_command_us = node.last_command_us();
  const std::uint64_t now = now_us();
  if (now < report_due_us_) return;
  report_due_us_ = now + report_us;
  add_one(out.writing);
  out.now_us = now;
  out.safe = node.safe();
  out.stack_bytes = std::max(std::uint32_t{out.stack_bytes}, most_stack_used());
  std::memcpy(const_cast<NodeCounters*>(&out.counters), &node.counters(), sizeof(NodeCounters));
  __asm__ volatile("dmb" ::: "memory");
  add_one(out.writing);
}

}  // namespace solenoid::mps2
