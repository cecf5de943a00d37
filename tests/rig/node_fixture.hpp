#pragma once

#include "controllers/systems.hpp"
#include "core/mpc/mode_set.hpp"
#include "experiments/rig/emulator.hpp"
#include "experiments/rig/node_protocol.hpp"
#include "tests/rig/rig_parts.hpp"

#include <gtest/gtest.h>

namespace solenoid::test {

inline constexpr NodePeer operator_at{0x7F000001, 50000}, stranger{0x7F000001, 50001};

/// A node over a plant that shows what it is told, and the packets of its controller.
struct NodeTest : testing::Test {
  using Type = NodePacket::Type;
  VariantConfig variant = with_valves("two_way");
  std::string wire = wire_text(system_of(variant).description(), system_of(variant).modes(variant));
  EmulatedNode node{std::make_unique<FaultyPlant>(std::make_unique<Mirror>(), std::vector<InjectedFault>{}, variant, 1),
                    usual_calibration(variant), system_of(variant).modes(variant), wire};
  std::uint64_t sequence = 100, session = 0, seen_us = 0;

  NodePacket packet(Type type) {
    NodePacket p(type);
    p.session = session;
    p.sequence = ++sequence;
    return p;
  }
  NodePacket command(std::uint32_t coils, double motor_v = 0.0) {
    NodePacket p = packet(Type::command);
    NodeCommand{coils, {to_microvolts(motor_v)}, seen_us}.put(p, 1);
    return p;
  }
  NodePacket hello(std::uint64_t number) {
    NodePacket p = packet(Type::hello);
    p.session = number;
    p.append(std::string_view(wire));
    return p;
  }
  std::optional<NodePacket> take(const NodePacket& p, double t, const NodePeer& from = operator_at) {
    return node.take(p, from, t);
  }
  /// The begin of the session that was offered to who asked with 11, as hello(11) does.
  NodePacket opening() {
    NodePacket p = packet(Type::open);
    p.append(std::uint64_t{11});
    return p;
  }
  void open(double t, const NodePeer& from = operator_at) {
    const auto offer = take(hello(11), t, from);
    ASSERT_TRUE(offer && offer->type == Type::offer && offer->number(0) == 11);
    session = offer->session;
    const auto first = take(opening(), t, from);
    ASSERT_TRUE(first && first->type == Type::sample);
    seen_us = first->time_us;
  }
  NodePacket request() {
    NodePacket p = packet(Type::request);
    p.append(seen_us);
    return p;
  }
  NodeSample asked(double t) {
    const auto sample = take(request(), t);
    seen_us = sample->time_us;
    return *NodeSample::of(*sample, 3);
  }
};

}  // namespace solenoid::test
