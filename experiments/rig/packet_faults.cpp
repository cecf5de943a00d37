#include "experiments/rig/packet_faults.hpp"

#include <algorithm>

namespace solenoid {

bool PacketFaults::to_node(std::string_view bytes, const NodePeer& from, double now_s, double time_s) {
  if (happens("lost", time_s)) return false;
  delay(to_node_, now_s, {std::string(bytes), from}, time_s);
  return true;
}

void PacketFaults::to_controller(std::string_view bytes, const NodePeer& to, double now_s, double time_s) {
  if (happens("lost", time_s)) return;
  Packet packet{std::string(bytes), to};
  if (happens("corrupt", time_s) && !packet.bytes.empty())
    packet.bytes[random_() % packet.bytes.size()] ^= static_cast<char>(1 + random_() % 255);
  delay(to_controller_, now_s, packet, time_s);
  if (happens("repeated", time_s)) delay(to_controller_, now_s, packet, time_s);
}

double PacketFaults::rest_s(double now_s, double rest_s) const {
  for (const Queue* queue : {&to_node_, &to_controller_})
    if (!queue->empty()) rest_s = std::min(rest_s, std::max(0.0, queue->begin()->first - now_s));
  return rest_s;
}

bool PacketFaults::happens(std::string_view kind, double time_s) {
  for (const InjectedFault& f : faults_)
    if (f.target == "packets" && f.kind == kind && f.active(time_s) && uniform() < f.value) return true;
  return false;
}

void PacketFaults::delay(Queue& queue, double due_s, Packet packet, double time_s) {
  for (const InjectedFault& f : faults_) {
    if (f.target != "packets" || !f.active(time_s)) continue;
    if (f.kind == "late" && &queue == &to_controller_) due_s += 1e-3 * f.value;
    if (f.kind == "jitter") due_s += 1e-3 * f.value * uniform();
  }
  queue.emplace(due_s, std::move(packet));
}

std::optional<PacketFaults::Packet> PacketFaults::next_due(Queue& queue, double now_s) {
  if (queue.empty() || queue.begin()->first > now_s) return std::nullopt;
  Packet due = std::move(queue.begin()->second);
  queue.erase(queue.begin());
  return due;
}

}  // namespace solenoid
