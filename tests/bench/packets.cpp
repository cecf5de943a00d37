// What a packet of the I/O node costs: made and read again, with and without a key.

#include "core/metrics/metrics.hpp"
#include "experiments/rig/node_protocol.hpp"

#include <chrono>
#include <vector>

#include <fmt/format.h>

namespace {

using namespace solenoid;

constexpr int rounds = 2000, packets = 50;

struct PacketCost {
  double encode_ns = 0.0, decode_ns = 0.0;
};

/// Medians over rounds of some packets each.
PacketCost measure(NodePacket packet, const NodeKey* key) {
  using Clock = std::chrono::steady_clock;
  const auto each_ns = [](Clock::duration d) { return std::chrono::duration<double, std::nano>(d).count() / packets; };
  std::array<char, NodePacket::most_size> bytes{};
  std::vector<double> encode, decode;
  encode.reserve(rounds);
  decode.reserve(rounds);
  std::size_t size = 0, good = 0;
  for (int round = 0; round < rounds; ++round) {
    const auto begin = Clock::now();
    for (int i = 0; i < packets; ++i) {
      ++packet.sequence;
      size = packet.encode(bytes, key);
    }
    const auto between = Clock::now();
    for (int i = 0; i < packets; ++i) good += NodePacket::decode({bytes.data(), size}, key) ? 1 : 0;
    encode.push_back(each_ns(between - begin));
    decode.push_back(each_ns(Clock::now() - between));
  }
  if (good != std::size_t{rounds} * packets) fmt::print("a packet did not come back\n");
  return {percentiles(encode).p50, percentiles(decode).p50};
}

}  // namespace

int main() {
  const NodeKey key{};
  NodePacket command(NodePacket::Type::command), sample(NodePacket::Type::sample), longest(NodePacket::Type::hello);
  NodeCommand{5, {1'000'000}}.put(command, 1);
  NodeSample{1, 0, 0, 0, 0, {1'000'000, 2'000'000, 3'000'000}}.put(sample, 3);
  longest.append(std::string(NodePacket::most_payload, 'x'));
  fmt::print("{:10} {:>6} {:>6} {:>12} {:>12}\n", "packet", "bytes", "key", "encode ns", "decode ns");
  for (const auto& [name, packet] : {std::pair("command", command), {"sample", sample}, {"longest", longest}})
    for (const NodeKey* with : {static_cast<const NodeKey*>(nullptr), &key}) {
      const PacketCost cost = measure(packet, with);
      fmt::print("{:10} {:6} {:>6} {:12.0f} {:12.0f}\n", name,
                 NodePacket::header_size + packet.length + NodePacket::tag_size, with ? "yes" : "no", cost.encode_ns,
                 cost.decode_ns);
    }
}
