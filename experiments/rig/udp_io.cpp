#include "experiments/rig/udp_io.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr double try_again_s = 0.05;
constexpr double most_age_s = 0.04;     // a node takes no command whose sample is older than 50 ms
constexpr double lost_after_s = 0.1;    // without an answer
constexpr double longest_stay_s = 1.0;  // of a packet in the system's buffer; beyond, a clock was set

double seconds(const timespec& t) { return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec); }

/// How long ago the system received the packet of a message; 0 if it does not say so.
double stayed_s(const msghdr& message) {
  auto& writable = const_cast<msghdr&>(message);  // which the macro asks for
  const cmsghdr* const stamp = CMSG_FIRSTHDR(&writable);
  if (!stamp || stamp->cmsg_level != SOL_SOCKET || stamp->cmsg_type != SO_TIMESTAMPNS) return 0.0;
  timespec came{}, now{};
  std::memcpy(&came, CMSG_DATA(stamp), sizeof came);
  ::clock_gettime(CLOCK_REALTIME, &now);
  const double stayed = seconds(now) - seconds(came);
  return stayed > 0.0 && stayed < longest_stay_s ? stayed : 0.0;
}

}  // namespace

std::string UdpSettings::text() const { return fmt::format("{}:{}", address, port); }

UdpSettings parse_node_address(const std::string& text) {
  UdpSettings settings;
  const std::size_t colon = text.rfind(':');
  settings.address = text.substr(0, colon);
  in_addr parsed{};
  const char *first = text.data() + std::min(colon, text.size() - 1) + 1, *last = text.data() + text.size();
  const auto [end, error] = std::from_chars(first, last, settings.port);
  if (colon == std::string::npos || error != std::errc() || end != last || settings.port < 1 || settings.port > 65535 ||
      inet_pton(AF_INET, settings.address.c_str(), &parsed) != 1)
    throw ConfigError(fmt::format("--node: '{}' is no address (allowed: an IPv4 address, a colon, a port)", text));
  return settings;
}

UdpSettings timed_for(UdpSettings settings, double tick_s) {
  settings.wait_s = 0.4 * tick_s;
  settings.most_age_s = std::min(5.0 * tick_s, most_age_s);
  return settings;
}

bool on_loopback(const UdpSettings& settings) { return settings.address.starts_with("127."); }

UdpIo::~UdpIo() {
  if (socket_ < 0) return;
  NodePacket packet(NodePacket::Type::close);
  if (session_ != 0) send(packet);
  ::close(socket_);
}

void UdpIo::connect() {
  if (socket_ >= 0) ::close(socket_);
  socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(settings_.port));
  inet_pton(AF_INET, settings_.address.c_str(), &to.sin_addr);
  const int stamped = 1;
  if (socket_ >= 0) ::setsockopt(socket_, SOL_SOCKET, SO_TIMESTAMPNS, &stamped, sizeof stamped);
  if (socket_ < 0 || ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0)
    throw OutputError(fmt::format("I/O node {}: {}", settings_.text(), std::strerror(errno)));
}

void UdpIo::open() {
  connect();
  refusal_.clear();
  other_version_ = 0;
  session_ = newest_echo_ = seen_us_ = measured_us_ = 0;
  node_clock_.reset();
  requests_ = {};
  sequence_ = 0;
  timeouts_seen_ = 0;
  const double begun = clock_.now_s();
  const auto patience_s = [&] { return refusal_.empty() ? settings_.open_wait_s : settings_.busy_wait_s; };
  while (clock_.now_s() - begun < patience_s()) {
    if (const auto offered = ask_for_session()) {
      session_ = *offered;
      NodePacket packet(NodePacket::Type::open);
      packet.append(asked_with_);
      note_request(sequence_ + 1);
      send(packet);
      if (wait_for_sample(packet.sequence, try_again_s)) {
        health_ = {};
        health_.connected = true;
        watch_anew();
        return;
      }
      session_ = 0;
    }
    clock_.sleep_until(clock_.now_s() + try_again_s);
  }
  if (!refusal_.empty()) throw OutputError(fmt::format("I/O node {}: {}", settings_.text(), refusal_));
  if (other_version_ != 0)
    throw OutputError(fmt::format("I/O node {}: it speaks version {} of the protocol, this program version {}",
                                  settings_.text(), other_version_, NodePacket::version));
  throw OutputError(fmt::format("I/O node {}: no answer within {} s (is `solenoid emulator` running{}?)",
                                settings_.text(), settings_.open_wait_s,
                                settings_.key ? ", with the same key" : ", without a key"));
}

std::optional<std::uint64_t> UdpIo::ask_for_session() {
  asked_with_ = unguessable_number();
  NodePacket hello(NodePacket::Type::hello);
  session_ = asked_with_;
  hello.append(std::string_view(wire_.text));
  send(hello);
  session_ = 0;
  for (const double until = clock_.now_s() + try_again_s; clock_.now_s() < until; wait(until))
    while (const auto packet = receive()) {
      if (packet->type == NodePacket::Type::offer && packet->number(0) == asked_with_) return packet->session;
      if (packet->type != NodePacket::Type::refuse || packet->session != asked_with_) continue;
      const std::string text(packet->text(4));
      if (static_cast<NodeRefusal>(packet->word(0)) == NodeRefusal::other_wire)
        throw ConfigError(fmt::format("I/O node {}: it is of \"{}\", this controller of \"{}\" (allowed: the same)",
                                      settings_.text(), text, wire_.text));
      refusal_ = static_cast<NodeRefusal>(packet->word(0)) == NodeRefusal::busy
                     ? "another controller has it: " + text
                     : fmt::format("it refuses (reason {}): {}", packet->word(0), text);
      return std::nullopt;
    }
  return std::nullopt;
}

bool UdpIo::send(NodePacket& packet) noexcept {
  packet.session = session_;
  packet.sequence = ++sequence_;
  packet.time_us = static_cast<std::uint64_t>(1e6 * clock_.now_s());
  std::array<char, NodePacket::most_size> bytes;
  const std::size_t size = packet.encode(bytes, key());
  return ::send(socket_, bytes.data(), size, MSG_DONTWAIT | MSG_NOSIGNAL) == static_cast<ssize_t>(size);
}

std::optional<NodePacket> UdpIo::receive() noexcept {
  std::array<char, NodePacket::most_size + 1> bytes;
  for (;;) {
    iovec room{bytes.data(), bytes.size()};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec))> control;
    msghdr message{nullptr, 0, &room, 1, control.data(), control.size(), 0};
    const ssize_t size = ::recvmsg(socket_, &message, MSG_DONTWAIT);
    if (size < 0) return std::nullopt;
    arrived_s_ = clock_.now_s() - stayed_s(message);
    if (auto packet = NodePacket::decode({bytes.data(), static_cast<std::size_t>(size)}, key())) return packet;
    if (of_another_version({bytes.data(), static_cast<std::size_t>(size)}, NodePacket::Type::refuse))
      other_version_ = bytes[3];
    ++health_.corrupt;
  }
}

void UdpIo::take(const NodeSample& sample, std::uint64_t node_time_us) noexcept {
  seen_us_ = std::max(seen_us_, node_time_us);
  health_.asked = std::max<std::int64_t>(health_.asked, sample.asked);
  if (sample.timeouts > timeouts_seen_) {
    inputs_.node_was_safe = true;
    health_.node_timeouts = timeouts_seen_ = sample.timeouts;
  }
  const std::uint64_t measured_us = node_time_us - static_cast<std::uint64_t>(sample.age_us);
  if (measured_us <= measured_us_) return;
  measured_us_ = measured_us;
  newer_ = true;
  for (std::size_t i = 0; i < wire_.channels; ++i) inputs_.volts[i] = from_microvolts(sample.microvolts[i]);
}

void UdpIo::note_request(std::uint64_t sequence) noexcept {
  Request& slot = requests_[next_request_++ % requests_.size()];
  if (!slot.answered) ++wire_health_.lost;
  slot = {sequence, clock_.now_s(), false};
}

/// What an answer says of the wire and of the node's clock; a repeated one says nothing.
bool UdpIo::note_answer(std::uint64_t echo, std::uint64_t node_time_us) noexcept {
  const auto request = std::ranges::find(requests_, echo, &Request::sequence);
  if (request == requests_.end() || request->answered) return true;
  request->answered = true;
  const double came_s = std::max(arrived_s_, request->sent_s), took_s = came_s - request->sent_s;
  ++wire_health_.answered;
  if (echo < newest_echo_) ++wire_health_.reordered;
  newest_echo_ = std::max(newest_echo_, echo);
  const bool late = took_s > settings_.wait_s;
  if (late) ++health_.late;
  share_late_ += ((late ? 1.0 : 0.0) - share_late_) / 16;
  round_trips_us_.add(1e6 * took_s);
  return node_clock_.exchange(request->sent_s, came_s, node_time_us);
}

void UdpIo::wait(double until_s) noexcept {
  const double left = std::max(0.0, until_s - clock_.now_s());
  const timespec rest{static_cast<time_t>(left), static_cast<long>(1e9 * (left - std::floor(left)))};
  pollfd ready{socket_, POLLIN, 0};
  ::ppoll(&ready, 1, &rest, nullptr);
}

bool UdpIo::drain(std::uint64_t sequence) noexcept {
  bool answered = false;
  while (const auto packet = receive()) {
    const auto sample = NodeSample::of(*packet, wire_.channels);
    if (packet->session == session_ && packet->type == NodePacket::Type::refuse)
      health_.displaced = true;
    else if (packet->session != session_ || packet->type != NodePacket::Type::sample || !sample || sample->age_us < 0 ||
             static_cast<std::uint64_t>(sample->age_us) > packet->time_us ||
             !note_answer(sample->echo, packet->time_us))
      ++health_.corrupt;
    else {
      take(*sample, packet->time_us);
      answered = answered || sample->echo == sequence;
    }
  }
  return answered;
}

bool UdpIo::wait_for_sample(std::uint64_t sequence, double wait_s) noexcept {
  for (const double until = clock_.now_s() + wait_s;;) {
    if (drain(sequence)) return true;
    if (clock_.now_s() >= until) return false;
    wait(until);
  }
}

bool UdpIo::fresh_at(double now_s) const noexcept {
  return newer_ && (!node_clock_.known() || node_clock_.age_s(measured_us_, now_s) <= settings_.most_age_s);
}

RigInputs UdpIo::read() noexcept {
  const double begun_s = clock_.now_s();
  ++health_.reads;
  ++wire_health_.reads;
  inputs_.node_was_safe = newer_ = false;
  drain(0);
  NodePacket request(NodePacket::Type::request);
  request.append(seen_us_);
  note_request(sequence_ + 1);
  if (send(request)) wait_for_sample(request.sequence, fresh_at(begun_s) && share_late_ > 0.5 ? 0.0 : settings_.wait_s);
  inputs_.fresh = fresh_at(begun_s);
  const double age_s = node_clock_.known() ? std::max(0.0, node_clock_.age_s(measured_us_, begun_s)) : 0.0;
  inputs_.age_s = inputs_.fresh ? age_s : 0.0;
  if (inputs_.fresh) {
    ages_us_.add(1e6 * age_s);
  } else {
    ++health_.missed;
    ++wire_health_.missed;
  }
  return inputs_;
}

IoHealth UdpIo::health() const noexcept {
  IoHealth health = health_;
  WireHealth wire = wire_health_;
  wire.round_trip_us = round_trips_us_.percentiles();
  wire.age_us = ages_us_.percentiles();
  const double now_s = clock_.now_s();
  wire.lost += std::ranges::count_if(requests_,
                                     [&](const Request& r) { return !r.answered && now_s - r.sent_s > lost_after_s; });
  if (node_clock_.known()) {
    wire.least_round_trip_us = 1e6 * node_clock_.least_round_trip_s();
    wire.drift_ppm = 1e6 * node_clock_.drift();
    wire.clock_error_us = 1e6 * node_clock_.error_s(now_s);
    wire.clock_jumps = node_clock_.jumps();
  }
  health.wire = wire;
  return health;
}

void UdpIo::watch_anew() noexcept {
  wire_health_ = {};
  round_trips_us_ = ages_us_ = PercentileSketch();
  requests_ = {};
}

void UdpIo::write(const RigOutputs& outputs) noexcept {
  NodePacket packet(NodePacket::Type::command);
  NodeCommand command{outputs.switches, {}, seen_us_};
  for (std::size_t i = 0; i < wire_.continuous; ++i) command.microvolts[i] = to_microvolts(outputs.volts[i]);
  command.put(packet, wire_.continuous);
  if (!send(packet)) ++health_.write_errors;
}

void UdpIo::safe() noexcept {
  if (socket_ < 0 || session_ == 0) return;
  for (int i = 0; i < 3; ++i) {  // a packet may be lost
    NodePacket packet(NodePacket::Type::safe);
    send(packet);
  }
}

}  // namespace solenoid
