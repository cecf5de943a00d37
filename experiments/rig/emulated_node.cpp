#include "experiments/rig/emulated_node.hpp"

#include "experiments/rig/node_protocol.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::size_t most_kept_events = 1000, most_refusals_told = 100;

}  // namespace

NodeDescription node_description(const Calibration& calibration, const ModeSet& modes, std::string_view wire,
                                 const NodeKey* key) {
  NodeDescription d;
  d.wire = wire;
  d.key = key;
  d.channels = calibration.channels.size();
  d.outputs = calibration.continuous.size();
  d.switches = first_switches(static_cast<std::size_t>(modes.switch_count()));
  d.safe_switches = modes.safe_pattern();
  for (std::size_t i = 0; i < d.outputs; ++i)
    d.continuous[i] = {to_microvolts(calibration.continuous[i].limit_v),
                       to_microvolts(calibration.continuous[i].volts(0.0))};
  d.sampling.conversions = 1;  // a converter of the plant's is one that is filtered already
  return d;
}

EmulatedNode::EmulatedNode(std::unique_ptr<FaultyPlant> plant, const Calibration& calibration, const ModeSet& modes,
                           std::string wire, const std::optional<NodeKey>& key)
    : plant_(std::move(plant)),
      calibration_(calibration),
      wire_(std::move(wire)),
      key_(key),
      description_(node_description(calibration, modes, wire_, key_ ? &*key_ : nullptr)),
      node_(description_, *this) {
  node_.start();
  commanded_ = false;  // which the plant is already
}

std::optional<NodePacket> EmulatedNode::take(const NodePacket& packet, const NodePeer& from, double now_s) {
  at(now_s);
  const NodePacket* const answer = node_.take(packet, from);
  advance();
  return answer ? std::optional(*answer) : std::nullopt;
}

void EmulatedNode::tick(double now_s) {
  at(now_s);
  node_.tick();
  advance();
}

double EmulatedNode::poll(NodeLink& link) {
  link_ = &link;
  node_.poll();
  link_ = nullptr;
  advance();
  return 1e-6 * node_.rest_us();
}

NodeLog EmulatedNode::log() const {
  const NodeCounters& c = node_.counters();
  return {events_, c, 1e-6 * static_cast<double>(c.longest_silence_us), 1e-6 * static_cast<double>(c.safe_after_us)};
}

void EmulatedNode::at(double now_s) { now_s_ = std::max(now_s_, now_s); }

void EmulatedNode::advance() {
  if (!begun()) return;
  sensors_ = plant_->read(time_s(now_s_));
  if (commanded_) plant_->write(command_);
  commanded_ = false;
}

std::uint64_t EmulatedNode::now_us() noexcept {
  if (commanded_) advance();
  if (link_) at(link_->now_s());
  return static_cast<std::uint64_t>(std::llround(1e6 * now_s_));
}

std::uint64_t EmulatedNode::random() noexcept { return unguessable_number(); }

std::size_t EmulatedNode::receive(std::span<char> room, NodePeer& from) noexcept {
  return link_ ? link_->receive(room, from, begun() ? time_s(now_s_) : 0.0) : 0;
}

void EmulatedNode::send(std::span<const char> bytes, const NodePeer& to) noexcept {
  if (link_) link_->send({bytes.data(), bytes.size()}, to, begun() ? time_s(now_s_) : 0.0);
}

void EmulatedNode::convert(std::span<std::int32_t> counts) noexcept {
  advance();
  for (std::size_t i = 0; i < counts.size(); ++i)
    counts[i] = to_microvolts(calibration_.channels[i].volts(sensors_.value[i]));
}

void EmulatedNode::set_switches(std::uint32_t pattern) noexcept {
  command_.switches = pattern;
  commanded_ = true;
}

void EmulatedNode::set_output(std::size_t index, std::int32_t microvolts) noexcept {
  command_.continuous[index] = calibration_.continuous[index].value(from_microvolts(microvolts));
  commanded_ = true;
}

void EmulatedNode::tell(NodeEvent event, const NodePeer& peer) noexcept {
  if (event == NodeEvent::opened && !begun()) begun_s_ = now_s_;
  const bool refusal = event == NodeEvent::refused_controller || event == NodeEvent::refused_version;
  if ((refusal && ++refusals_told_ > most_refusals_told) || events_.size() >= most_kept_events) return;
  const auto words = [&]() -> std::string {
    switch (event) {
      case NodeEvent::opened:
        return "opened by " + peer_text(peer);
      case NodeEvent::closed:
        return "closed";
      case NodeEvent::safe_by_timeout:
        return "safe by timeout";
      case NodeEvent::safe_by_command:
        return "safe by command";
      case NodeEvent::safe_by_session:
        return "safe by another session";
      case NodeEvent::commanded_again:
        return "commanded again";
      case NodeEvent::refused_command:
        return "refused a command that its outputs cannot be";
      case NodeEvent::refused_controller:
        return fmt::format("refused {}: {} has the node", peer_text(peer), peer_text(node_.peer()));
      case NodeEvent::refused_version:
        return fmt::format("refused {}: it speaks another version of the protocol, this node version {}",
                           peer_text(peer), NodePacket::version);
    }
    return "";
  };
  events_.push_back({begun() ? time_s(now_s_) : 0.0, words()});
}

}  // namespace solenoid
