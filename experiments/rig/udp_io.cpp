#include "experiments/rig/udp_io.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"

#include <cerrno>
#include <cmath>
#include <cstring>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace solenoid {
UdpSettings parse_node_address(const std::string& text) {
  UdpSettings settings;
  const std::size_t colon = text.rfind(':');
  settings.address = text.substr(0, colon);
  in_addr parsed{};
  if (colon != std::string::npos) settings.port = std::atoi(text.c_str() + colon + 1);
  if (inet_pton(AF_INET, settings.address.c_str(), &parsed) != 1 || settings.port < 1 || settings.port > 65535)
    throw ConfigError(fmt::format("--node: '{}' is no address (allowed: an IPv4 address, a colon, a port)", text));
  return settings;
}

UdpIo::~UdpIo() {
  if (socket_ >= 0) ::close(socket_);
}

void UdpIo::open() {
  socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(settings_.port));
  inet_pton(AF_INET, settings_.address.c_str(), &to.sin_addr);
  if (socket_ < 0 || ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0)
    throw OutputError(fmt::format("I/O node {}:{}: {}", settings_.address, settings_.port, std::strerror(errno)));
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  session_ = static_cast<std::uint32_t>(now.tv_nsec) ^ (static_cast<std::uint32_t>(now.tv_sec) << 8) ^
             static_cast<std::uint32_t>(getpid());
  const double give_up = clock_.now_s() + settings_.open_wait_s;
  while (clock_.now_s() < give_up) {
    send(NodePacket::Type::open, {});
    if (wait_for_sample(sequence_, 0.05)) {
      health_ = {};
      health_.connected = true;
      return;
    }
    clock_.sleep_until(clock_.now_s() + 0.05);
  }
  throw OutputError(fmt::format("I/O node {}:{}: no answer within {} s (is `solenoid emulator` running?)",
                                settings_.address, settings_.port, settings_.open_wait_s));
}

bool UdpIo::send(NodePacket::Type type, const std::array<std::int32_t, 6>& words) noexcept {
  NodePacket packet;
  packet.type = type;
  packet.session = session_;
  packet.sequence = ++sequence_;
  packet.time_us = static_cast<std::uint64_t>(1e6 * clock_.now_s());
  packet.words = words;
  const auto bytes = packet.encode();
  return ::send(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
}

bool UdpIo::receive(std::uint32_t sequence) noexcept {
  bool arrived = false;
  char bytes[2 * NodePacket::size];
  for (;;) {
    const ssize_t size = ::recv(socket_, bytes, sizeof bytes, MSG_DONTWAIT);
    if (size < 0) return arrived;
    const auto packet = NodePacket::decode({bytes, static_cast<std::size_t>(size)});
    if (!packet || packet->type != NodePacket::Type::sample || packet->session != session_) {
      ++health_.corrupt;
      continue;
    }
    const auto echo = static_cast<std::uint32_t>(packet->words[0]);
    if (!newer(echo, newest_echo_)) continue;  // a repetition, or overtaken
    newest_echo_ = echo;
    inputs_.position_v = from_microvolts(packet->words[1]);
    inputs_.pressure_a_v = from_microvolts(packet->words[2]);
    inputs_.pressure_b_v = from_microvolts(packet->words[3]);
    if (packet->words[4] != timeouts_seen_) {
      inputs_.node_was_safe = inputs_.node_was_safe || packet->words[4] > timeouts_seen_;
      timeouts_seen_ = packet->words[4];
      health_.node_timeouts = timeouts_seen_;
    }
    if (echo == sequence)
      arrived = true;
    else
      ++health_.late;
  }
}

bool UdpIo::wait_for_sample(std::uint32_t sequence, double wait_s) noexcept {
  const double until = clock_.now_s() + wait_s;
  for (;;) {
    if (receive(sequence)) return true;
    const double left = until - clock_.now_s();
    if (left <= 0) return false;
    const timespec rest{static_cast<time_t>(left), static_cast<long>(1e9 * (left - std::floor(left)))};
    pollfd ready{socket_, POLLIN, 0};
    ::ppoll(&ready, 1, &rest, nullptr);
  }
}

RigInputs UdpIo::read() noexcept {
  ++health_.reads;
  inputs_.node_was_safe = false;
  inputs_.fresh = send(NodePacket::Type::request, {}) && wait_for_sample(sequence_, settings_.wait_s);
  if (!inputs_.fresh) ++health_.missed;
  return inputs_;
}

void UdpIo::write(const RigOutputs& outputs) noexcept {
  if (!send(NodePacket::Type::command, {static_cast<std::int32_t>(outputs.coils), to_microvolts(outputs.motor_v)}))
    ++health_.write_errors;
}

void UdpIo::safe() noexcept {
  if (socket_ < 0) return;
  for (int i = 0; i < 3; ++i) send(NodePacket::Type::safe, {});  // a packet may be lost
}

}  // namespace solenoid
