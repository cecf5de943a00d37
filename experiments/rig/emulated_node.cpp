#include "experiments/rig/emulated_node.hpp"

#include "core/systems/actuator/signals.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::size_t most_events = 1000;

}  // namespace

EmulatedNode::EmulatedNode(MakePlant make_plant, const Calibration& calibration, SwitchPattern known_coils)
    : make_plant_(std::move(make_plant)), calibration_(calibration), known_coils_(known_coils) {}

std::optional<NodePacket> EmulatedNode::take(const NodePacket& packet, double now_s) {
  if (packet.type == NodePacket::Type::open) {
    begin_session(packet, now_s);
    return sample(packet, now_s);
  }
  if (!plant_ || packet.session != session_ || !newer(packet.sequence, newest_)) {
    ++log_.old_packets;
    return std::nullopt;
  }
  newest_ = packet.sequence;
  switch (packet.type) {
    case NodePacket::Type::request:
      return sample(packet, now_s);
    case NodePacket::Type::command:
      command(packet, now_s);
      return std::nullopt;
    case NodePacket::Type::safe:
      if (!safe_) make_safe(now_s, "safe by command");
      return std::nullopt;
    default:
      return std::nullopt;
  }
}

void EmulatedNode::begin_session(const NodePacket& packet, double now_s) {
  const bool again = plant_ && packet.session == session_;
  newest_ = packet.sequence;
  if (again) return;  // the first answer was lost
  plant_ = make_plant_(static_cast<std::uint64_t>(++log_.sessions));
  session_ = packet.session;
  session_timeouts_ = session_refused_ = 0;
  opened_s_ = now_s_ = now_s;
  safe_ = true;
  commanded_ = false;
  event(now_s, "opened");
  advance(now_s);
}

void EmulatedNode::command(const NodePacket& packet, double now_s) {
  advance(now_s);
  const auto coils = static_cast<SwitchPattern>(packet.words[0]);
  const double volts = 1e-6 * packet.words[1];
  ++log_.commands;
  if ((coils & ~known_coils_) != 0 || std::abs(volts) > calibration_.motor_limit_v + 1e-6) {
    ++log_.refused;
    ++session_refused_;
    event(now_s, fmt::format("refused coils {:b}, motor {} V", coils, volts));
    return;  // and does not count as a command
  }
  if (commanded_) log_.longest_silence_s = std::max(log_.longest_silence_s, now_s - last_command_s_);
  if (safe_ && commanded_) event(now_s, "commanded again");
  safe_ = false;
  commanded_ = true;
  last_command_s_ = now_s;
  plant_->write(actuator_command(coils, calibration_.motor.value(volts)));
}

void EmulatedNode::make_safe(double now_s, const char* why) {
  advance(now_s);
  plant_->write({});
  safe_ = true;
  event(now_s, why);
}

void EmulatedNode::tick(double now_s) {
  if (!plant_) return;
  advance(now_s);
  if (safe_ || !commanded_ || now_s - last_command_s_ < node_timeout_s) return;
  ++log_.timeouts;
  ++session_timeouts_;
  log_.safe_after_s = now_s - last_command_s_;
  make_safe(now_s, "safe by timeout");
}

void EmulatedNode::advance(double now_s) {
  now_s_ = std::max(now_s_, now_s);
  sensors_ = plant_->read(session_time_s(now_s_));
}

NodePacket EmulatedNode::sample(const NodePacket& asked, double now_s) {
  advance(now_s);
  NodePacket answer;
  answer.type = NodePacket::Type::sample;
  answer.flags = safe_ ? NodePacket::flag_safe : 0;
  answer.session = session_;
  answer.sequence = ++answers_;
  answer.time_us = static_cast<std::uint64_t>(1e6 * session_time_s(now_s_));
  answer.words = {static_cast<std::int32_t>(asked.sequence),
                  to_microvolts(calibration_.position.volts(sensors_.value[position_channel])),
                  to_microvolts(calibration_.pressure_a.volts(sensors_.value[pressure_a_channel])),
                  to_microvolts(calibration_.pressure_b.volts(sensors_.value[pressure_b_channel])),
                  session_timeouts_,
                  session_refused_};
  return answer;
}

void EmulatedNode::event(double now_s, std::string what) {
  if (log_.events.size() < most_events) log_.events.push_back({session_time_s(now_s), std::move(what)});
}

}  // namespace solenoid
