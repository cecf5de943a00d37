#include "experiments/rig/node_socket.hpp"

#include "experiments/base/files.hpp"

#include <cerrno>
#include <cstring>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace solenoid {

sockaddr_in socket_address(const NodePeer& peer) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(peer.port);
  at.sin_addr.s_addr = htonl(peer.address);
  return at;
}

NodeSocket::NodeSocket(int port) : file_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  const sockaddr_in at = socket_address({INADDR_LOOPBACK, static_cast<std::uint16_t>(port)});
  if (file_ < 0 || ::bind(file_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0) {
    const std::string why = std::strerror(errno);
    if (file_ >= 0) ::close(file_);
    throw OutputError(fmt::format("127.0.0.1:{}: cannot be listened on: {}", port, why));
  }
  const int count = 1;
  ::setsockopt(file_, SOL_SOCKET, SO_RXQ_OVFL, &count, sizeof count);
}

NodeSocket::~NodeSocket() { ::close(file_); }

std::optional<std::string_view> NodeSocket::receive(NodePeer& from) {
  sockaddr_in sender{};
  iovec room{bytes_.data(), bytes_.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(std::uint32_t))> control;
  msghdr message{&sender, sizeof sender, &room, 1, control.data(), control.size(), 0};
  const ssize_t size = ::recvmsg(file_, &message, MSG_DONTWAIT);
  if (size < 0) return std::nullopt;
  if (const cmsghdr* more = CMSG_FIRSTHDR(&message); more && more->cmsg_type == SO_RXQ_OVFL)
    std::memcpy(&dropped_, CMSG_DATA(more), sizeof dropped_);
  from = {ntohl(sender.sin_addr.s_addr), ntohs(sender.sin_port)};
  return std::string_view(bytes_.data(), static_cast<std::size_t>(size));
}

void NodeSocket::send(std::string_view bytes, const NodePeer& to) {
  const sockaddr_in receiver = socket_address(to);
  [[maybe_unused]] const ssize_t sent = ::sendto(file_, bytes.data(), bytes.size(), MSG_DONTWAIT,
                                                 reinterpret_cast<const sockaddr*>(&receiver), sizeof receiver);
}

void NodeSocket::wait(double seconds, int other_file) {
  const timespec rest{0, static_cast<long>(1e9 * seconds)};
  pollfd ready[] = {{file_, POLLIN, 0}, {other_file, POLLIN, 0}};  // of a negative file nothing is awaited
  ::ppoll(ready, 2, &rest, nullptr);
}

}  // namespace solenoid
