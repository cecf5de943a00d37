#include "experiments/rig/node/node.hpp"

#include <algorithm>
#include <limits>

namespace solenoid {
namespace {

constexpr int most_packets = 32;  // taken in a round, however many more there are
constexpr std::uint64_t longest_round_us = 500;
constexpr std::size_t most_answer_to_a_stranger = 3;  // times what was asked with, as RFC 9000, section 8, has it
constexpr std::uint64_t offer_holds_us = 1'000'000;
constexpr std::int32_t rounding_microvolts = 1;  // a voltage travels in whole microvolts

constexpr bool of_a_node(NodePacket::Type type) {
  using Type = NodePacket::Type;
  return type == Type::offer || type == Type::refuse || type == Type::sample;
}

/// A few words for a person, of bounded length.
class Words {
 public:
  Words& operator<<(std::string_view text) noexcept {
    const std::size_t size = std::min(text.size(), room_.size() - size_);
    std::copy_n(text.data(), size, room_.data() + size_);
    size_ += size;
    return *this;
  }
  Words& operator<<(std::uint64_t number) noexcept {
    std::array<char, 20> digits;
    std::size_t at = digits.size();
    do {
      digits[--at] = static_cast<char>('0' + number % 10);
      number /= 10;
    } while (number != 0);
    return *this << std::string_view(digits.data() + at, digits.size() - at);
  }
  Words& operator<<(const NodePeer& peer) noexcept {
    for (const int shift : {24, 16, 8, 0})
      *this << std::uint64_t{(peer.address >> shift) & 255u} << (shift ? "." : ":");
    return *this << std::uint64_t{peer.port};
  }
  std::string_view text() const noexcept { return {room_.data(), size_}; }

 private:
  std::array<char, 80> room_;
  std::size_t size_ = 0;
};

}  // namespace

void Node::start() noexcept {
  now_us_ = board_.now_us();
  board_.set_switches(of_.safe_switches);
  for (std::size_t i = 0; i < of_.outputs; ++i) board_.set_output(i, of_.continuous[i].safe_microvolts);
  safe_ = true;
}

void Node::run_once() noexcept {
  poll();
  board_.wait(rest_us());
}

void Node::poll() noexcept {
  tick();
  const std::uint64_t begun_us = now_us_;
  NodePeer from;
  for (int taken = 0; taken < most_packets && now_us_ - begun_us < longest_round_us; ++taken) {
    const std::size_t size = board_.receive(bytes_, from);
    if (size == 0) break;
    ++counters_.packets;
    tick();
    take_bytes({bytes_.data(), std::min(size, bytes_.size())}, from);
  }
  tick();
  board_.kick_watchdog();
}

std::uint32_t Node::rest_us() const noexcept {
  std::uint64_t due_us = std::min(now_us_ + longest_round_us, sampler_.due_us());
  if (!safe_) due_us = std::min(due_us, last_command_us_ + node_timeout_us);
  return due_us > now_us_ ? static_cast<std::uint32_t>(due_us - now_us_) : 0;
}

void Node::tick() noexcept {
  now_us_ = std::max(now_us_, board_.now_us());
  watch();
  sampler_.poll(board_, now_us_);
}

void Node::watch() noexcept {
  if (safe_ || now_us_ - last_command_us_ < node_timeout_us) return;
  ++counters_.timeouts;
  ++session_timeouts_;
  timeout_us_ = now_us_;
  counters_.safe_after_us = std::max(counters_.safe_after_us, now_us_ - last_command_us_);
  make_safe(NodeEvent::safe_by_timeout);
}

void Node::make_safe(NodeEvent why) noexcept {
  start();
  board_.tell(why, peer_);
}

void Node::take_bytes(std::string_view bytes, const NodePeer& from) noexcept {
  if (NodePacket::decode(bytes, of_.key, packet_)) {
    if (const NodePacket* const reply = take(packet_, from)) send(*reply, from);
    return;
  }
  ++counters_.invalid_packets;
  if (!of_another_version(bytes)) return;
  if (counters_.other_versions++ == 0 || from != last_foreign_) board_.tell(NodeEvent::refused_version, from);
  last_foreign_ = from;
  constexpr std::string_view why = "this node speaks version 2 of the protocol";
  constexpr std::size_t size = NodePacket::header_size + sizeof(std::int32_t) + why.size() + NodePacket::tag_size;
  if (size <= most_answer_to_a_stranger * bytes.size()) send(*refuse(0, NodeRefusal::other_version, why), from);
}

void Node::send(const NodePacket& packet, const NodePeer& to) noexcept {
  const std::size_t size = packet.encode(std::span(bytes_).first<NodePacket::most_size>(), of_.key);
  board_.send(std::span(bytes_).first(size), to);
}

const NodePacket* Node::take(const NodePacket& packet, const NodePeer& from) noexcept {
  using Type = NodePacket::Type;
  tick();
  if (packet.type == Type::hello) return welcome(packet, from);
  if (of_a_node(packet.type)) {  // its own, sent back by somebody
    ++counters_.foreign_packets;
    return nullptr;
  }
  if (session_ == 0 || packet.session != session_ || from != peer_) {
    if (packet.type == Type::open) return open(packet, from);
    ++counters_.foreign_packets;
    if (packet.type != Type::request) return nullptr;
    return taken() ? busy(packet.session, from) : refuse(packet.session, NodeRefusal::no_session, "");
  }
  if (packet.sequence <= newest_) {
    ++counters_.old_packets;
    return nullptr;
  }
  newest_ = packet.sequence;
  heard_us_ = now_us_;
  switch (packet.type) {
    case Type::command:
      command(packet);
      return nullptr;
    case Type::safe:
    case Type::close:
      if (!safe_) make_safe(NodeEvent::safe_by_command);
      if (packet.type == Type::close) {
        session_ = 0;
        board_.tell(NodeEvent::closed, peer_);
      }
      return nullptr;
    default:  // a request, or an open again: its first answer was lost
      return sample(packet);
  }
}

const NodePacket* Node::welcome(const NodePacket& hello, const NodePeer& from) noexcept {
  if (hello.text(0) != of_.wire) {
    const std::size_t room = most_answer_to_a_stranger * (NodePacket::header_size + hello.length);
    const std::size_t size = std::min(of_.wire.size(), room - NodePacket::header_size);
    return refuse(hello.session, NodeRefusal::other_wire, {of_.wire.data(), size});
  }
  if (taken() && from != peer_) return busy(hello.session, from);
  Offer& offer = offers_[next_offer_++ % offers_.size()];
  do offer = {from, board_.random(), now_us_ + offer_holds_us};
  while (offer.session == 0);
  ++counters_.offers;
  NodePacket& reply = answer(NodePacket::Type::offer, offer.session);
  reply.append(hello.session);
  return &reply;
}

const NodePacket* Node::open(const NodePacket& packet, const NodePeer& from) noexcept {
  const auto offer = std::find_if(offers_.begin(), offers_.end(), [&](const Offer& o) {
    return o.session != 0 && o.session == packet.session && o.peer == from && now_us_ < o.until_us;
  });
  if (offer == offers_.end()) {
    ++counters_.foreign_packets;
    return nullptr;
  }
  if (taken() && from != peer_) return busy(packet.session, from);
  begin_session(*offer);
  *offer = {};
  newest_ = packet.sequence;
  return sample(packet);
}

void Node::begin_session(const Offer& offer) noexcept {
  if (!safe_) make_safe(NodeEvent::safe_by_session);
  ++counters_.sessions;
  session_ = offer.session;
  peer_ = offer.peer;
  heard_us_ = now_us_;
  session_timeouts_ = session_refused_ = session_asked_ = 0;
  commanded_ = false;
  sampler_.forget();
  board_.tell(NodeEvent::opened, peer_);
}

NodePacket& Node::answer(NodePacket::Type type, std::uint64_t session) noexcept {
  answer_.type = type;
  answer_.flags = 0;
  answer_.length = 0;
  answer_.session = session;
  answer_.sequence = ++answers_;
  answer_.time_us = now_us_;
  return answer_;
}

const NodePacket* Node::refuse(std::uint64_t session, NodeRefusal why, std::string_view text) noexcept {
  NodePacket& reply = answer(NodePacket::Type::refuse, session);
  reply.append(static_cast<std::int32_t>(why));
  reply.append(text);
  return &reply;
}

const NodePacket* Node::busy(std::uint64_t session, const NodePeer& from) noexcept {
  ++counters_.asked;
  if (session_asked_ < std::numeric_limits<std::int32_t>::max()) ++session_asked_;
  if (from != last_foreign_) board_.tell(NodeEvent::refused_controller, from);
  last_foreign_ = from;
  Words why;
  why << peer_ << ", heard of " << (now_us_ - heard_us_ + 500) / 1000 << " ms ago";
  return refuse(session, NodeRefusal::busy, why.text());
}

bool Node::of_now(const NodeCommand& command) const noexcept {
  return command.seen_us >= timeout_us_ && command.seen_us <= now_us_ &&
         now_us_ - command.seen_us <= node_command_age_us;
}

bool Node::possible(const NodeCommand& command) const noexcept {
  if ((command.switches & ~of_.switches) != 0) return false;
  for (std::size_t i = 0; i < of_.outputs; ++i) {
    const std::int64_t most = std::int64_t{of_.continuous[i].most_microvolts} + rounding_microvolts;
    if (command.microvolts[i] > most || command.microvolts[i] < -most) return false;
  }
  return true;
}

void Node::command(const NodePacket& packet) noexcept {
  const auto wanted = NodeCommand::of(packet, of_.outputs);
  if (wanted && !of_now(*wanted)) {
    ++counters_.old_packets;
    return;
  }
  ++counters_.commands;
  if (!wanted || !possible(*wanted)) {
    ++counters_.refused;
    ++session_refused_;
    board_.tell(NodeEvent::refused_command, peer_);
    return;  // and does not count as a command
  }
  if (commanded_) counters_.longest_silence_us = std::max(counters_.longest_silence_us, now_us_ - last_command_us_);
  if (safe_ && commanded_) board_.tell(NodeEvent::commanded_again, peer_);
  safe_ = false;
  commanded_ = true;
  last_command_us_ = now_us_;
  board_.set_switches(wanted->switches);
  for (std::size_t i = 0; i < of_.outputs; ++i) board_.set_output(i, wanted->microvolts[i]);
}

const NodePacket* Node::sample(const NodePacket& asked) noexcept {
  const Sampler::Sample measured = sampler_.newest(board_, now_us_);
  NodePacket& reply = answer(NodePacket::Type::sample, session_);
  reply.flags = safe_ ? NodePacket::flag_safe : 0;
  NodeSample seen;
  seen.echo = asked.sequence;
  seen.timeouts = session_timeouts_;
  seen.refused = session_refused_;
  seen.asked = session_asked_;
  seen.age_us = static_cast<std::int32_t>(now_us_ - measured.time_us);
  for (std::size_t i = 0; i < of_.channels; ++i)
    seen.microvolts[i] = of_.inputs[i].microvolts(measured.sums[i], measured.conversions);
  seen.put(reply, of_.channels);
  return &reply;
}

}  // namespace solenoid
