#include "experiments/rig/node/ports/network.hpp"

#include <algorithm>

namespace solenoid {
namespace {

constexpr std::uint16_t ethernet_ipv4 = 0x0800, ethernet_arp = 0x0806;
constexpr std::uint8_t protocol_icmp = 1, protocol_udp = 17;
constexpr std::size_t at_ip = 14, at_payload = 34;  // in the frame: an IPv4 header without options
constexpr std::size_t arp_size = 28, ip_size = 20, udp_size = 8, icmp_size = 8;
constexpr std::uint32_t right_sum = 0xffff;

std::uint32_t byte(std::span<const char> in, std::size_t at) { return static_cast<unsigned char>(in[at]); }
std::uint32_t word16(std::span<const char> in, std::size_t at) { return byte(in, at) << 8 | byte(in, at + 1); }
std::uint32_t word32(std::span<const char> in, std::size_t at) { return word16(in, at) << 16 | word16(in, at + 2); }

void put16(std::span<char> out, std::size_t at, std::uint32_t value) {
  out[at] = static_cast<char>(value >> 8);
  out[at + 1] = static_cast<char>(value);
}
void put32(std::span<char> out, std::size_t at, std::uint32_t value) {
  put16(out, at, value >> 16);
  put16(out, at + 2, value);
}
void put(std::span<const char> from, std::span<char> out, std::size_t at) {
  std::copy(from.begin(), from.end(), out.begin() + static_cast<std::ptrdiff_t>(at));
}

std::uint16_t checksum(std::uint32_t sum) { return static_cast<std::uint16_t>(~sum); }

/// The sum of what UDP's checksum covers beside the packet: addresses, protocol and length.
std::uint32_t pseudo_header(std::span<const char> addresses, std::size_t size) {
  return internet_sum(addresses, protocol_udp + static_cast<std::uint32_t>(size));
}

/// Whether one may answer an address: neither nobody's nor this computer's own, nor that of many.
bool of_one(std::uint32_t address) {
  const std::uint32_t first = address >> 24;
  return first != 0 && first != 127 && first < 224;
}

}  // namespace

std::uint32_t internet_sum(std::span<const char> bytes, std::uint32_t sum) noexcept {
  std::size_t i = 0;
  for (; i + 1 < bytes.size(); i += 2) sum += word16(bytes, i);
  if (i < bytes.size()) sum += byte(bytes, i) << 8;
  while (sum >> 16) sum = (sum & 0xffff) + (sum >> 16);
  return sum;
}

Network::Taken Network::take(std::span<const char> frame, std::span<char, most_frame> room) noexcept {
  if (frame.size() < at_ip || frame.size() > most_frame) return {};
  const bool to_all = std::ranges::all_of(frame.first(6), [](char c) { return c == '\xff'; });
  const bool to_this =
      std::ranges::equal(frame.first(6), at_.mac, {}, {}, [](std::uint8_t b) { return static_cast<char>(b); });
  if ((!to_all && !to_this) || (byte(frame, 6) & 1) != 0) return {};
  const std::uint32_t type = word16(frame, 12);
  if (type == ethernet_arp) return {arp(frame, room), {}, {}};
  if (type != ethernet_ipv4 || to_all) return {};

  const std::span<const char> packet = frame.subspan(at_ip);
  if (packet.size() < ip_size || byte(packet, 0) != 0x45) return {};  // version 4, a header without options
  const std::size_t size = word16(packet, 2);
  if (size < ip_size || size > packet.size()) return {};  // a short frame is filled up: its packet may be shorter
  if ((word16(packet, 6) & 0x3fff) != 0) return {};       // a fragment
  if (internet_sum(packet.first(ip_size)) != right_sum) return {};
  const std::uint32_t from = word32(packet, 12);
  if (word32(packet, 16) != at_.address || from == at_.address || !of_one(from)) return {};

  const std::span<const char> inner = packet.subspan(ip_size, size - ip_size);
  if (byte(packet, 9) == protocol_icmp) return {echo(frame, size, room), {}, {}};
  if (byte(packet, 9) != protocol_udp || inner.size() < udp_size) return {};
  const std::size_t length = word16(inner, 4);
  if (length < udp_size || length > inner.size() || word16(inner, 2) != at_.port || word16(inner, 0) == 0) return {};
  if (word16(inner, 6) != 0 &&  // 0: the sender made none
      internet_sum(inner.first(length), pseudo_header(packet.subspan(12, 8), length)) != right_sum)
    return {};
  remember(from, frame);
  return {{}, inner.subspan(udp_size, length - udp_size), NodePeer{from, static_cast<std::uint16_t>(word16(inner, 0))}};
}

void Network::remember(std::uint32_t address, std::span<const char> frame) noexcept {
  const auto known = std::ranges::find(neighbours_, address, &Neighbour::address);
  Neighbour& of = known != neighbours_.end() ? *known : neighbours_[next_neighbour_++ % neighbours_.size()];
  of.address = address;
  std::ranges::transform(frame.subspan(6, 6), of.mac.begin(), [](char c) { return static_cast<std::uint8_t>(c); });
}

std::span<const char> Network::make(std::span<const char> payload, const NodePeer& to,
                                    std::span<char, most_frame> room) noexcept {
  const auto known = std::ranges::find(neighbours_, to.address, &Neighbour::address);
  if (payload.size() > most_payload || to.address == 0 || known == neighbours_.end()) return {};
  std::array<char, 6> mac;
  std::ranges::transform(known->mac, mac.begin(), [](std::uint8_t b) { return static_cast<char>(b); });
  const std::size_t length = udp_size + payload.size();
  put_ethernet(room, mac, ethernet_ipv4);
  put_ipv4(room, length, protocol_udp, to.address);
  const std::span<char> udp = room.subspan(at_payload, length);
  put16(udp, 0, at_.port);
  put16(udp, 2, to.port);
  put16(udp, 4, static_cast<std::uint32_t>(length));
  put16(udp, 6, 0);
  put(payload, udp, udp_size);
  const std::uint16_t sum = checksum(internet_sum(udp, pseudo_header(room.subspan(at_ip + 12, 8), length)));
  put16(udp, 6, sum != 0 ? sum : right_sum);  // 0 would mean that there is none
  return room.first(at_payload + length);
}

std::span<const char> Network::arp(std::span<const char> frame, std::span<char, most_frame> room) noexcept {
  const std::span<const char> asked = frame.subspan(at_ip);
  if (asked.size() < arp_size) return {};
  // Ethernet, IPv4, addresses of 6 and 4 bytes, a request
  if (word32(asked, 0) != (1u << 16 | ethernet_ipv4) || word32(asked, 4) != (6u << 24 | 4u << 16 | 1u)) return {};
  if (word32(asked, 24) != at_.address || word32(asked, 14) == at_.address) return {};
  put_ethernet(room, frame.subspan(6).first<6>(), ethernet_arp);
  const std::span<char> answer = room.subspan(at_ip, arp_size);
  put(asked.first(6), answer, 0);
  put16(answer, 6, 2);                 // a reply
  put(room.subspan(6, 6), answer, 8);  // from this address
  put32(answer, 14, at_.address);
  put(asked.subspan(8, 10), answer, 18);  // to the sender's
  return room.first(at_ip + arp_size);
}

std::span<const char> Network::echo(std::span<const char> frame, std::size_t size,
                                    std::span<char, most_frame> room) noexcept {
  const std::span<const char> asked = frame.subspan(at_payload, size - ip_size);
  if (asked.size() < icmp_size || word16(asked, 0) != 0x0800 || internet_sum(asked) != right_sum) return {};
  put_ethernet(room, frame.subspan(6).first<6>(), ethernet_ipv4);
  put_ipv4(room, asked.size(), protocol_icmp, word32(frame, at_ip + 12));
  const std::span<char> answer = room.subspan(at_payload, asked.size());
  put(asked, answer, 0);
  put32(answer, 0, 0);
  put16(answer, 2, checksum(internet_sum(answer)));
  return room.first(at_payload + asked.size());
}

void Network::put_ethernet(std::span<char, most_frame> room, std::span<const char, 6> to, std::uint16_t type) noexcept {
  put(to, room, 0);
  std::ranges::transform(at_.mac, room.begin() + 6, [](std::uint8_t b) { return static_cast<char>(b); });
  put16(room, 12, type);
}

void Network::put_ipv4(std::span<char, most_frame> room, std::size_t payload, std::uint8_t protocol,
                       std::uint32_t to) noexcept {
  const std::span<char> header = room.subspan(at_ip, ip_size);
  put16(header, 0, 0x4500);
  put16(header, 2, static_cast<std::uint32_t>(ip_size + payload));
  put16(header, 4, ++identification_);
  put16(header, 6, 0x4000);  // not to be cut
  put16(header, 8, 64u << 8 | protocol);
  put16(header, 10, 0);
  put32(header, 12, at_.address);
  put32(header, 16, to);
  put16(header, 10, checksum(internet_sum(header)));
}

}  // namespace solenoid
