// Packets to a node, with and without a key, from its controller and from strangers.
#include "controllers/systems.hpp"
#include "controllers/variant.hpp"
#include "core/mpc/mode_set.hpp"
#include "experiments/rig/emulated_node.hpp"
#include "experiments/rig/node_protocol.hpp"
#include "tests/fuzz/fuzz.hpp"

#include <algorithm>
#include <cmath>

namespace {

using namespace solenoid;

struct Still final : SimulatedPlant {
  Measurement read(double time_s) noexcept override {
    Measurement m;
    m.time_s = time_s;
    return m;
  }
  void write(const Command&) noexcept override {}
  double consumed() const override { return 0.0; }
};

/// Brings bytes once, whatever they are; what is answered must be a packet.
struct Raw final : NodeLink {
  Raw(std::string_view data, const NodePeer& peer, double now, const NodeKey& secret)
      : bytes(data), from(peer), time_s(now), key(secret) {}
  double now_s() override { return time_s; }
  std::size_t receive(std::span<char> room, NodePeer& sender, double) override {
    const std::size_t size = std::min(bytes.size(), room.size());
    std::copy_n(bytes.data(), size, room.data());
    bytes = {};
    sender = from;
    return size;
  }
  void send(std::string_view answer, const NodePeer&, double) override {
    if (!NodePacket::decode(answer, &key)) fuzz::find("an answer that nobody can read");
  }
  std::string_view bytes;
  NodePeer from;
  double time_s;
  const NodeKey& key;
};

}  // namespace

/// Each packet: a byte (bit 0: from a stranger; bit 1: let time pass; bit 2: its session is put right; bit 3: raw), a
/// length of two bytes, and so many bytes: a whole packet if it is raw, else a type and a payload.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const VariantConfig variant = new_variant();
  static const ModeSet modes = system_of(variant).modes(variant);
  static const std::string wire = wire_text(system_of(variant).description(), modes);
  const NodeKey key{};
  EmulatedNode node(std::make_unique<FaultyPlant>(std::make_unique<Still>(), std::vector<InjectedFault>{}, variant, 1),
                    usual_calibration(variant), modes, wire, key);
  constexpr NodePeer controller{0x7F000001, 1}, stranger{0x7F000001, 2};
  double now_s = 0.0;
  std::uint64_t session = 0, sequence = 0;
  const auto send = [&](const NodePacket& packet, const NodePeer& from) {
    if (const auto answer = node.take(packet, from, now_s)) {
      std::array<char, NodePacket::most_size> room;
      const std::size_t length = answer->encode(room, &key);
      if (!NodePacket::decode({room.data(), length}, &key)) fuzz::find("an answer that nobody can read");
      if (from == controller && answer->type == NodePacket::Type::offer) session = answer->session;
    }
  };
  NodePacket hello(NodePacket::Type::hello);
  hello.append(std::string_view(wire));
  send(hello, controller);
  NodePacket open(NodePacket::Type::open);
  open.session = session;
  open.sequence = ++sequence;
  open.append(hello.session);
  send(open, controller);
  while (size >= 3) {
    const std::uint8_t how = bytes[0];
    const std::size_t length = std::min<std::size_t>(size - 3, bytes[1] + 256u * bytes[2]);
    const std::string_view data = fuzz::text_of(bytes + 3, length);
    bytes += 3 + length;
    size -= 3 + length;
    const bool foreign = (how & 1) != 0;
    now_s += (how & 2) != 0 ? 0.03 : 0.001;
    node.tick(now_s);
    const Command before = node.outputs();
    if ((how & 8) != 0) {
      Raw link(data, foreign ? stranger : controller, now_s, key);
      node.poll(link);
    } else if (!data.empty()) {
      NodePacket packet(static_cast<NodePacket::Type>(1 + static_cast<std::uint8_t>(data[0]) % 9));
      packet.session = (how & 4) != 0 ? session : 0;
      packet.sequence = ++sequence;
      packet.append(data.substr(1));
      send(packet, foreign ? stranger : controller);
    }
    const Command& after = node.outputs();
    if (foreign && node.log().counters.sessions == 1 && !(after == before))
      fuzz::find("a stranger's packet moved the outputs");
    if ((after.switches & ~((SwitchPattern{1} << modes.switch_count()) - 1)) != 0) fuzz::find("a switch that is none");
    if (!(std::abs(after.continuous[0]) <= 8.01)) fuzz::find("a force beyond the motor's");
  }
  return 0;
}
