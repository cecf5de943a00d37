#include "experiments/rig/emulated_node.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::size_t most_kept_events = 1000, most_refusals_told = 100;
constexpr std::size_t most_answer_to_a_stranger = 3;  // times what was asked with, as RFC 9000, section 8, has it
constexpr double offer_holds_s = 1.0;
constexpr double rounding_v = 1e-6;  // a voltage travels in whole microvolts

constexpr bool of_a_node(NodePacket::Type type) {
  using Type = NodePacket::Type;
  return type == Type::offer || type == Type::refuse || type == Type::sample;
}

}  // namespace

std::string NodePeer::text() const {
  return fmt::format("{}.{}.{}.{}:{}", address >> 24, (address >> 16) & 255u, (address >> 8) & 255u, address & 255u,
                     port);
}

EmulatedNode::EmulatedNode(std::unique_ptr<FaultyPlant> plant, const Calibration& calibration, const ModeSet& modes,
                           std::string wire)
    : plant_(std::move(plant)),
      calibration_(calibration),
      safe_command_{modes.safe_pattern(), {}},
      known_switches_(first_switches(static_cast<std::size_t>(modes.switch_count()))),
      wire_(std::move(wire)) {}

std::optional<NodePacket> EmulatedNode::take(const NodePacket& packet, const NodePeer& from, double now_s) {
  using Type = NodePacket::Type;
  watch(now_s);
  if (packet.type == Type::hello) return welcome(packet, from, now_s);
  if (of_a_node(packet.type)) {  // its own, sent back by somebody
    ++log_.foreign_packets;
    return std::nullopt;
  }
  if (session_ == 0 || packet.session != session_ || from != peer_) {
    if (packet.type == Type::open) return open(packet, from, now_s);
    ++log_.foreign_packets;
    if (packet.type != Type::request) return std::nullopt;
    return taken(now_s) ? busy(packet, from, now_s) : refuse(packet, NodeRefusal::no_session, "");
  }
  if (packet.sequence <= newest_) {
    ++log_.old_packets;
    return std::nullopt;
  }
  newest_ = packet.sequence;
  heard_s_ = now_s;
  switch (packet.type) {
    case Type::command:
      command(packet, now_s);
      return std::nullopt;
    case Type::safe:
    case Type::close:
      if (!safe_) make_safe(now_s, "safe by command");
      if (packet.type == Type::close) {
        session_ = 0;
        event(now_s, "closed");
      }
      return std::nullopt;
    default:  // a request, or an open again: its first answer was lost
      return sample(packet, now_s);
  }
}

NodePacket EmulatedNode::welcome(const NodePacket& hello, const NodePeer& from, double now_s) {
  if (hello.text(0) != wire_) {
    const std::size_t room = most_answer_to_a_stranger * (NodePacket::header_size + hello.length);
    return refuse(hello, NodeRefusal::other_wire, wire_.substr(0, room - NodePacket::header_size));
  }
  if (taken(now_s) && from != peer_) return busy(hello, from, now_s);
  Offer& offer = offers_[next_offer_++ % offers_.size()];
  offer = {from, unguessable_number(), now_s + offer_holds_s};
  NodePacket answer(NodePacket::Type::offer);
  answer.session = offer.session;
  answer.append(hello.session);
  return answer;
}

std::optional<NodePacket> EmulatedNode::open(const NodePacket& packet, const NodePeer& from, double now_s) {
  const auto offer = std::ranges::find_if(offers_, [&](const Offer& o) {
    return o.session != 0 && o.session == packet.session && o.peer == from && now_s < o.until_s;
  });
  if (offer == offers_.end()) {
    ++log_.foreign_packets;
    return std::nullopt;
  }
  if (taken(now_s) && from != peer_) return busy(packet, from, now_s);
  begin_session(*offer, now_s);
  *offer = {};
  newest_ = packet.sequence;
  return sample(packet, now_s);
}

void EmulatedNode::begin_session(const Offer& offer, double now_s) {
  if (begun_s_ < 0) begun_s_ = now_s_ = now_s;
  if (!safe_) make_safe(now_s, "safe by another session");
  ++log_.sessions;
  session_ = offer.session;
  peer_ = offer.peer;
  heard_s_ = now_s;
  session_timeouts_ = session_refused_ = session_asked_ = 0;
  commanded_ = false;
  event(now_s, "opened by " + peer_.text());
  advance(now_s);
}

NodePacket EmulatedNode::refuse(const NodePacket& packet, NodeRefusal why, const std::string& text) {
  NodePacket answer(NodePacket::Type::refuse);
  answer.session = packet.session;
  answer.sequence = ++answers_;
  answer.append(static_cast<std::int32_t>(why));
  answer.append(text);
  return answer;
}

NodePacket EmulatedNode::busy(const NodePacket& packet, const NodePeer& from, double now_s) {
  ++log_.asked;
  if (session_asked_ < std::numeric_limits<std::int32_t>::max()) ++session_asked_;
  if (from != last_foreign_ && ++refusals_told_ <= most_refusals_told)
    event(now_s, fmt::format("refused {}: {} has the node", from.text(), peer_.text()));
  last_foreign_ = from;
  return refuse(packet, NodeRefusal::busy,
                fmt::format("{}, heard of {:.0f} ms ago", peer_.text(), 1e3 * (now_s - heard_s_)));
}

bool EmulatedNode::of_now(const NodeCommand& command, double now_s) const {
  const std::uint64_t now_us = time_us(now_s);
  return command.seen_us >= timeout_us_ && command.seen_us <= now_us &&
         static_cast<double>(now_us - command.seen_us) <= 1e6 * node_command_age_s;
}

void EmulatedNode::command(const NodePacket& packet, double now_s) {
  const auto wanted = NodeCommand::of(packet, calibration_.continuous.size());
  if (wanted && !of_now(*wanted, now_s)) {
    ++log_.old_packets;
    return;
  }
  advance(now_s);
  ++log_.commands;
  bool possible = wanted && (wanted->switches & ~known_switches_) == 0;
  for (std::size_t i = 0; possible && i < calibration_.continuous.size(); ++i)
    possible = std::abs(wanted->volts[i]) <= calibration_.continuous[i].limit_v + rounding_v;
  if (!possible) {
    ++log_.refused;
    ++session_refused_;
    event(now_s, "refused a command that its outputs cannot be");
    return;  // and does not count as a command
  }
  if (commanded_) log_.longest_silence_s = std::max(log_.longest_silence_s, now_s - last_command_s_);
  if (safe_ && commanded_) event(now_s, "commanded again");
  safe_ = false;
  commanded_ = true;
  last_command_s_ = now_s;
  Command told{wanted->switches, {}};
  for (std::size_t i = 0; i < calibration_.continuous.size(); ++i)
    told.continuous[i] = calibration_.continuous[i].value(wanted->volts[i]);
  plant_->write(told);
}

void EmulatedNode::make_safe(double now_s, const char* why) {
  advance(now_s);
  plant_->write(safe_command_);
  safe_ = true;
  event(now_s, why);
}

void EmulatedNode::tick(double now_s) {
  if (!begun()) return;
  advance(now_s);
  watch(now_s);
}

void EmulatedNode::watch(double now_s) {
  if (safe_ || now_s - last_command_s_ < node_timeout_s) return;
  ++log_.timeouts;
  ++session_timeouts_;
  timeout_us_ = time_us(now_s);
  log_.safe_after_s = std::max(log_.safe_after_s, now_s - last_command_s_);
  make_safe(now_s, "safe by timeout");
}

void EmulatedNode::advance(double now_s) {
  now_s_ = std::max(now_s_, now_s);
  sensors_ = plant_->read(time_s(now_s_));
}

NodePacket EmulatedNode::sample(const NodePacket& asked, double now_s) {
  advance(now_s);
  NodePacket answer(NodePacket::Type::sample);
  answer.flags = safe_ ? NodePacket::flag_safe : 0;
  answer.session = session_;
  answer.sequence = ++answers_;
  answer.time_us = time_us(now_s_);
  NodeSample seen{asked.sequence, session_timeouts_, session_refused_, session_asked_, {}};
  for (std::size_t i = 0; i < calibration_.channels.size(); ++i)
    seen.volts[i] = calibration_.channels[i].volts(sensors_.value[i]);
  seen.put(answer, calibration_.channels.size());
  return answer;
}

void EmulatedNode::event(double now_s, std::string what) {
  if (log_.events.size() < most_kept_events) log_.events.push_back({time_s(now_s), std::move(what)});
}

}  // namespace solenoid
