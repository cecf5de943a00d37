#include "experiments/rig/node/node.hpp"

#include "experiments/rig/node/bytes.hpp"

#include <algorithm>
#include <limits>

namespace solenoid {
namespace {

constexpr int most_packets = 32;  // taken in a round, however many more there are
constexpr std::uint64_t longest_round_us = 500;
constexpr std::size_t most_answer_to_a_stranger = 3;  // times what was asked with, as RFC 9000, section 8, has it
constexpr std::uint64_t offer_second_us = 1'000'000;  // an offer holds for what is left of its second and the next
constexpr std::int32_t rounding_microvolts = 1;       // a voltage travels in whole microvolts

/// One more, as far as the number goes.
constexpr void count(std::int32_t& number) noexcept {
  if (number < std::numeric_limits<std::int32_t>::max()) ++number;
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

Node::Node(const NodeDescription& description, NodeHardware& board) noexcept
    : of_(description), board_(board), sampler_(description.sampling, description.channels) {
  of_.channels = std::min(of_.channels, most_node_channels);
  of_.outputs = std::min(of_.outputs, most_node_outputs);
}

void Node::start() noexcept {
  set_safe_outputs();
  now_us_ = board_.now_us();
  char* const secret = reinterpret_cast<char*>(secret_.bytes.data());
  for (const std::size_t half : {0, 8}) put_little_endian(secret + half, board_.random());
}

void Node::set_safe_outputs() noexcept {
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
  if (now_us_ == kicked_us_) return;  // a clock that stands still is what a watchdog is for
  kicked_us_ = now_us_;
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
  count(session_timeouts_);
  timeout_us_ = now_us_;
  set_safe_outputs();
  counters_.safe_after_us = std::max(counters_.safe_after_us, board_.now_us() - last_command_us_);
  board_.tell(NodeEvent::safe_by_timeout, peer_);
}

void Node::make_safe(NodeEvent why) noexcept {
  set_safe_outputs();
  board_.tell(why, peer_);
}

bool Node::worth_a_tag(std::string_view bytes) const noexcept {
  using Type = NodePacket::Type;
  constexpr std::size_t least = NodePacket::header_size + NodePacket::tag_size;
  if (bytes.size() < least) return false;
  const std::size_t length = bytes.size() - least;
  switch (static_cast<Type>(bytes[4])) {
    case Type::hello:
      return length <= NodePacket::most_payload;
    case Type::command:
      return length == (1 + of_.outputs) * sizeof(std::int32_t) + sizeof(std::uint64_t);
    case Type::open:
    case Type::request:
      return length == sizeof(std::uint64_t);
    default:
      return length == 0;
  }
}

void Node::take_bytes(std::string_view bytes, const NodePeer& from) noexcept {
  if (worth_a_tag(bytes) && NodePacket::decode(bytes, of_.key, packet_)) {
    if (const NodePacket* const reply = take(packet_, from)) send(*reply, from);
    return;
  }
  if (!of_another_version(bytes, NodePacket::Type::hello)) {
    ++counters_.invalid_packets;
    return;
  }
  ++counters_.other_versions;
  if (from != last_other_version_) board_.tell(NodeEvent::refused_version, from);
  last_other_version_ = from;
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
  const bool of_a_node = packet.type == Type::offer || packet.type == Type::refuse || packet.type == Type::sample;
  if (of_a_node || session_ == 0 || packet.session != session_ || from != peer_)
    return take_of_a_stranger(packet, from);
  std::uint64_t& newest = packet.type == Type::request ? newest_request_ : newest_;
  if (packet.sequence <= newest) {
    ++counters_.old_packets;
    return nullptr;
  }
  newest = packet.sequence;
  switch (packet.type) {
    case Type::command:
      command(packet);
      return nullptr;
    case Type::open:  // again: its first answer was lost
    case Type::request:
      ++counters_.requests;
      if (packet.type == Type::request && of_now(packet.number(0))) heard_us_ = now_us_;
      return sample(packet);
    default:  // safe, close
      ++(packet.type == Type::safe ? counters_.safes : counters_.closes);
      if (!safe_) make_safe(NodeEvent::safe_by_command);
      if (packet.type == Type::close) {
        session_ = 0;
        board_.tell(NodeEvent::closed, peer_);
      }
      return nullptr;
  }
}

/// A node's own packets, sent back by somebody, are foreign too. Who asks for a sample of a session that is over is told so;
/// of the one that is, nothing is said to anybody else.
const NodePacket* Node::take_of_a_stranger(const NodePacket& packet, const NodePeer& from) noexcept {
  if (packet.type == NodePacket::Type::open) return open(packet, from);
  const bool another_session = packet.type == NodePacket::Type::request && packet.session != session_;
  if (another_session && taken()) return busy(packet.session, from);
  ++counters_.foreign_packets;
  return another_session ? refuse(packet.session, NodeRefusal::no_session, "") : nullptr;
}

const NodePacket* Node::welcome(const NodePacket& hello, const NodePeer& from) noexcept {
  if (hello.text(0) != of_.wire) {
    ++counters_.other_wires;
    const std::size_t room = most_answer_to_a_stranger * (NodePacket::header_size + hello.length);
    const std::size_t size = std::min(of_.wire.size(), room - NodePacket::header_size);
    return refuse(hello.session, NodeRefusal::other_wire, {of_.wire.data(), size});
  }
  if (taken() && from != peer_) return busy(hello.session, from);
  ++counters_.offers;
  NodePacket& reply = answer(NodePacket::Type::offer, offered(from, hello.session, now_us_ / offer_second_us));
  reply.append(hello.session);
  return &reply;
}

std::uint64_t Node::offered(const NodePeer& to, std::uint64_t asked_with, std::uint64_t second) const noexcept {
  std::array<char, 32> what{};
  put_little_endian(what.data(), asked_with);
  put_little_endian(what.data() + 8, second);
  put_little_endian(what.data() + 16, static_cast<std::uint64_t>(counters_.sessions));
  put_little_endian(what.data() + 24, to.address);
  put_little_endian(what.data() + 28, to.port);
  const NodeTag tag = siphash_2_4_128({what.data(), what.size()}, secret_);
  return take_little_endian<std::uint64_t>(tag.data()) | 1;  // 0 is none
}

const NodePacket* Node::open(const NodePacket& packet, const NodePeer& from) noexcept {
  const std::uint64_t second = now_us_ / offer_second_us, asked_with = packet.number(0);
  if (packet.session != offered(from, asked_with, second) &&
      (second == 0 || packet.session != offered(from, asked_with, second - 1))) {
    ++counters_.foreign_packets;
    return nullptr;
  }
  if (taken() && from != peer_) return busy(packet.session, from);
  begin_session(packet.session, from);
  newest_ = newest_request_ = packet.sequence;
  return sample(packet);
}

void Node::begin_session(std::uint64_t session, const NodePeer& from) noexcept {
  if (!safe_) make_safe(NodeEvent::safe_by_session);
  ++counters_.sessions;
  session_ = session;
  peer_ = from;
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
  count(session_asked_);
  if (from != last_asking_) board_.tell(NodeEvent::refused_controller, from);
  last_asking_ = from;
  Words why;
  why << peer_ << ", heard of " << (now_us_ - heard_us_ + 500) / 1000 << " ms ago";
  return refuse(session, NodeRefusal::busy, why.text());
}

bool Node::of_now(std::uint64_t seen_us) const noexcept {
  return seen_us <= now_us_ && now_us_ - seen_us <= node_command_age_us;
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
  if (wanted && (!of_now(wanted->seen_us) || wanted->seen_us < timeout_us_)) {
    ++counters_.old_packets;
    return;
  }
  heard_us_ = now_us_;
  if (!wanted || !possible(*wanted)) {
    ++counters_.refused;
    count(session_refused_);
    board_.tell(NodeEvent::refused_command, peer_);
    return;  // and does not count as a command
  }
  ++counters_.commands;
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
