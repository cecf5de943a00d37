#include "experiments/rig/node/node.hpp"
#include "experiments/rig/node/ports/template/configuration.hpp"
#include "experiments/rig/node/ports/template/to_fill_in.hpp"
#include "experiments/rig/node/ports/template/w5500.hpp"

#include <array>
#include <cstdint>

// A port for a microcontroller with a W5500 on its SPI bus: the ten functions over what to_fill_in.hpp asks for. A chip
// with an Ethernet MAC of its own (STM32F407 or F767 with a LAN8742) takes Network in the W5500's place, as
// ports/mps2_an385 does.

namespace solenoid::port {
namespace {

class Board final : public NodeHardware {
 public:
  bool start() noexcept {
    to_fill_in::start();
    return chip_.start(mac, address, mask, gateway, static_cast<std::uint16_t>(node_port));
  }

  std::uint64_t now_us() noexcept override {
    const std::uint32_t now = to_fill_in::microseconds();
    if (now < counted_) ++wraps_;  // each 71 minutes; the loop looks far more often
    counted_ = now;
    return std::uint64_t{wraps_} << 32 | now;
  }
  std::uint64_t random() noexcept override {
    const std::uint64_t high = to_fill_in::true_random();
    return high << 32 | to_fill_in::true_random();
  }
  std::size_t receive(std::span<char> room, NodePeer& from) noexcept override { return chip_.receive(room, from); }
  void send(std::span<const char> bytes, const NodePeer& to) noexcept override { chip_.send(bytes, to); }
  void convert(std::span<std::int32_t> counts) noexcept override { to_fill_in::convert(counts); }
  void set_switches(std::uint32_t pattern) noexcept override { to_fill_in::set_switches(pattern); }
  void set_output(std::size_t index, std::int32_t microvolts) noexcept override {
    to_fill_in::set_output(index, microvolts);
  }
  void kick_watchdog() noexcept override { to_fill_in::feed_watchdog(); }
  void wait(std::uint32_t microseconds) noexcept override { to_fill_in::rest(microseconds); }
  void tell(NodeEvent event, const NodePeer&) noexcept override { to_fill_in::tell(static_cast<std::uint8_t>(event)); }

 private:
  W5500 chip_;
  std::uint32_t counted_ = 0, wraps_ = 0;
};

constexpr NodeDescription description = [] {
  NodeDescription d;
  d.wire = wire;
  d.key = key;
  d.channels = channels;
  d.outputs = outputs;
  d.switches = switches;
  d.safe_switches = safe_switches;
  d.inputs.fill(input);
  d.continuous.fill(output);
  return d;
}();

}  // namespace
}  // namespace solenoid::port

int main() {
  using namespace solenoid;
  static port::Board board;
  static Node node(port::description, board);
  if (!board.start()) return 1;  // no Ethernet chip: the watchdog starts it again, outputs safe
  node.start();
  for (;;) node.run_once();
}
