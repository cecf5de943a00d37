#pragma once

#include "controllers/variant.hpp"
#include "experiments/plants/simulated_plant.hpp"
#include "experiments/rig/node_protocol.hpp"

#include <array>
#include <string>

namespace solenoid::test {

/// A plant that shows what it is told.
struct Mirror final : SimulatedPlant {
  Measurement read(double time_s) noexcept override { return {time_s, 0.02, 150e3, 120e3}; }
  void write(const Command& c) noexcept override { last = c; }
  double consumed() const override { return 0; }
  Command last;
};

/// A new variant with these valves.
inline VariantConfig with_valves(const std::string& valves) {
  VariantConfig variant = new_variant();
  variant.modes = valves;
  return variant;
}

/// A packet as it travels.
inline std::string bytes_of(const NodePacket& packet, const NodeKey* key = nullptr) {
  std::array<char, NodePacket::most_size> room;
  return {room.data(), packet.encode(room, key)};
}

}  // namespace solenoid::test
