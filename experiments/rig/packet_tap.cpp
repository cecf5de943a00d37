#include "experiments/rig/packet_tap.hpp"

#include "core/rt/process_setup.hpp"
#include "experiments/base/files.hpp"
#include "experiments/rig/node/bytes.hpp"
#include "experiments/rig/node/packet.hpp"
#include "experiments/rig/node_socket.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr std::size_t most_kept = 4096;
constexpr int priority = 84;  // above a controller's, below the node's

sockaddr_in loopback(int port) { return socket_address({INADDR_LOOPBACK, static_cast<std::uint16_t>(port)}); }

}  // namespace

int loopback_socket(int at_port, int to_port) {
  const int file = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const sockaddr_in at = loopback(at_port), to = loopback(to_port);
  if (file >= 0 && ::bind(file, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0 &&
      (to_port == 0 || ::connect(file, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0))
    return file;
  const std::string why = std::strerror(errno);
  if (file >= 0) ::close(file);
  throw OutputError(fmt::format("127.0.0.1:{}: {}", at_port, why));
}

PacketTap::PacketTap(int front_port, int node_port) {
  front_ = loopback_socket(front_port, 0);
  try {
    back_ = loopback_socket(0, node_port);
  } catch (...) {
    ::close(front_);
    throw;
  }
  newest_.reserve(most_kept);
  thread_ = std::thread([this] {
    prepare_thread("tap");
    set_fifo_priority("tap", priority);
    forward();
  });
}

PacketTap::~PacketTap() {
  ended_ = true;
  thread_.join();
  ::close(front_);
  ::close(back_);
}

void PacketTap::forward() {
  std::array<char, NodePacket::most_size + 1> bytes;
  sockaddr_in controller{};
  while (!ended_) {
    std::array<pollfd, 2> ready{pollfd{front_, POLLIN, 0}, pollfd{back_, POLLIN, 0}};
    ::poll(ready.data(), ready.size(), 10);
    socklen_t length = sizeof controller;
    for (ssize_t size; (size = ::recvfrom(front_, bytes.data(), bytes.size(), MSG_DONTWAIT,
                                          reinterpret_cast<sockaddr*>(&controller), &length)) >= 0;) {
      if (::send(back_, bytes.data(), static_cast<std::size_t>(size), MSG_DONTWAIT) < 0) continue;
      ++forwarded_;
      keep(bytes.data(), static_cast<std::size_t>(size));
    }
    for (ssize_t size; (size = ::recv(back_, bytes.data(), bytes.size(), MSG_DONTWAIT)) >= 0;) {
      if (size >= static_cast<ssize_t>(NodePacket::header_size))
        node_time_us_ = take_little_endian<std::uint64_t>(bytes.data() + 24);
      if (controller.sin_port != 0)
        ::sendto(front_, bytes.data(), static_cast<std::size_t>(size), MSG_DONTWAIT,
                 reinterpret_cast<const sockaddr*>(&controller), sizeof controller);
    }
  }
}

void PacketTap::keep(const char* bytes, std::size_t size) {
  if (size > 4 && bytes[4] == static_cast<char>(NodePacket::Type::command)) ++commands_;
  const std::lock_guard lock(mutex_);
  if (newest_.size() < most_kept)
    newest_.emplace_back(bytes, size);
  else
    newest_[next_].assign(bytes, size);
  next_ = (next_ + 1) % most_kept;
}

std::vector<std::string> PacketTap::recorded() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> all = newest_;
  if (all.size() == most_kept) std::rotate(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(next_), all.end());
  return all;
}

std::string PacketTap::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_.empty() ? "" : newest_[(next_ + most_kept - 1) % most_kept % newest_.size()];
}

bool PacketTap::inject(const std::string& bytes) const {
  return ::send(back_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >= 0;
}

}  // namespace solenoid
