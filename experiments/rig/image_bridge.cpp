#include "experiments/rig/image_bridge.hpp"

#include <algorithm>

namespace solenoid {
namespace {

constexpr std::uint16_t type_ipv4 = 0x0800, type_arp = 0x0806;
constexpr std::uint8_t bridged_udp = 17;
constexpr std::size_t ip_begins = 14, udp_begins = 34, payload_begins = 42;
constexpr std::uint32_t own_address = address_beyond(127u << 24 | 1u);
constexpr double longest_search_s = 5.0, ask_again_s = 0.02;

void put16(std::string& out, std::uint32_t value) {
  out += static_cast<char>(value >> 8);
  out += static_cast<char>(value);
}
void put32(std::string& out, std::uint32_t value) {
  put16(out, value >> 16);
  put16(out, value);
}
void set16(std::string& out, std::size_t at, std::uint32_t value) {
  out[at] = static_cast<char>(value >> 8);
  out[at + 1] = static_cast<char>(value);
}
void put(std::string& out, const MacAddress& mac) {
  for (const std::uint8_t byte : mac) out += static_cast<char>(byte);
}
std::uint32_t number_at(std::string_view in, std::size_t at, std::size_t size) {
  std::uint32_t value = 0;
  for (const char byte : in.substr(at, size)) value = value << 8 | static_cast<unsigned char>(byte);
  return value;
}

}  // namespace

std::string ImageBridge::frame(std::uint16_t type, std::string_view content) const {
  std::string out;
  put(out, mac_);
  put(out, own_mac);
  put16(out, type);
  return out.append(content);
}

std::string ImageBridge::ip_frame(std::uint8_t protocol, std::uint32_t from, std::string_view content) const {
  std::string header;
  put16(header, 0x4500);
  put16(header, static_cast<std::uint32_t>(20 + content.size()));
  put32(header, 0x00004000);  // not to be cut
  put16(header, 64u << 8 | protocol);
  put16(header, 0);
  put32(header, from);
  put32(header, node_address);
  set16(header, 10, ~internet_sum(header));
  return frame(type_ipv4, header.append(content));
}

std::string ImageBridge::udp_frame(const NodePeer& from, std::uint16_t to_port, std::string_view content) const {
  std::string udp, pseudo;
  const auto size = static_cast<std::uint32_t>(8 + content.size());
  put16(udp, from.port);
  put16(udp, to_port);
  put16(udp, size);
  put16(udp, 0);
  udp.append(content);
  put32(pseudo, from.address);
  put32(pseudo, node_address);
  put32(pseudo, std::uint32_t{bridged_udp} << 16 | size);
  const auto sum = static_cast<std::uint16_t>(~internet_sum(udp, internet_sum(pseudo)));
  set16(udp, 6, sum != 0 ? sum : 0xffff);
  return ip_frame(bridged_udp, from.address, udp);
}

void ImageBridge::find() {
  std::string question;
  put32(question, 1u << 16 | type_ipv4);
  put32(question, 6u << 24 | 4u << 16 | 1u);
  put(question, own_mac);
  put32(question, own_address);
  put(question, MacAddress{});
  put32(question, node_address);
  for (double waited = 0.0; waited < longest_search_s; waited += ask_again_s) {
    board_.send(frame(type_arp, question));
    wait_s(ask_again_s);
    while (const auto answer = board_.receive()) {
      const bool is_one = answer->size() >= 42 && number_at(*answer, 12, 2) == type_arp &&
                          number_at(*answer, 20, 2) == 2 && number_at(*answer, 28, 4) == node_address;
      if (!is_one) continue;
      std::ranges::transform(answer->substr(22, 6), mac_.begin(), [](char c) { return static_cast<std::uint8_t>(c); });
      return;
    }
  }
  throw OutputError("the node's image does not answer on its network");
}

void ImageBridge::send(std::string_view bytes, const NodePeer& from) {
  if (bytes.size() <= Network::most_payload)
    board_.send(udp_frame({address_beyond(from.address), from.port}, node_port, bytes));
}

std::optional<ImageBridge::Received> ImageBridge::receive() {
  while (const auto frame = board_.receive()) {
    if (frame->size() < payload_begins || number_at(*frame, 12, 2) != type_ipv4 ||
        number_at(*frame, 23, 1) != bridged_udp)
      continue;
    const std::size_t size = number_at(*frame, udp_begins + 4, 2);
    if (size < 8 || udp_begins + size > frame->size()) continue;
    return Received{frame->substr(payload_begins, size - 8),
                    {address_here(number_at(*frame, ip_begins + 16, 4)),
                     static_cast<std::uint16_t>(number_at(*frame, udp_begins + 2, 2))}};
  }
  return std::nullopt;
}

}  // namespace solenoid
