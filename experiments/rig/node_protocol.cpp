#include "experiments/rig/node_protocol.hpp"

#include "core/config/reader.hpp"
#include "core/config/whole_file.hpp"
#include "core/mpc/mode_set.hpp"
#include "core/system/description.hpp"

#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include <fmt/format.h>
#include <sys/random.h>
#include <sys/stat.h>

namespace solenoid {
namespace {

constexpr std::size_t most_key_bytes = 64;

/// What a hexadecimal digit stands for; none of another character.
std::optional<unsigned> digit(char c) {
  if (c >= '0' && c <= '9') return static_cast<unsigned>(c - '0');
  if (c >= 'a' && c <= 'f') return static_cast<unsigned>(c - 'a') + 10;
  if (c >= 'A' && c <= 'F') return static_cast<unsigned>(c - 'A') + 10;
  return std::nullopt;
}

}  // namespace

NodeKey read_node_key(const std::string& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0)
    throw ConfigError(
        fmt::format("{}: cannot be read: {} (allowed: a file of 32 hexadecimal digits)", path, std::strerror(errno)));
  if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    throw ConfigError(fmt::format("{}: a key that others may read is none (allowed: chmod 600)", path));
  std::string digits = read_whole_file(path, most_key_bytes).value_or("");
  while (!digits.empty() && std::isspace(static_cast<unsigned char>(digits.back()))) digits.pop_back();
  NodeKey key;
  bool good = digits.size() == 2 * key.bytes.size();
  for (std::size_t i = 0; good && i < key.bytes.size(); ++i) {
    const auto high = digit(digits[2 * i]), low = digit(digits[2 * i + 1]);
    good = high && low;
    if (good) key.bytes[i] = static_cast<unsigned char>(*high << 4 | *low);
  }
  if (!good) throw ConfigError(fmt::format("{}: is no key (allowed: 32 hexadecimal digits)", path));
  return key;
}

std::string wire_text(const SystemDescription& system, const ModeSet& modes) {
  std::string text = system.name;
  const auto list = [&](const char* what, const std::vector<Signal>& signals) {
    text += fmt::format("; {}:", what);
    for (const Signal& signal : signals) text += fmt::format(" {} [{}]", signal.name, signal.unit);
  };
  list("channels", system.channels);
  list("continuous", system.continuous);
  text += "; switches:";
  for (const Switch& s : modes.switches()) text += " " + s.name;
  constexpr std::size_t most = NodePacket::most_payload - sizeof(std::int32_t);
  if (text.size() > most)
    throw ConfigError(
        fmt::format("{}: its names are too long for a packet (allowed: {} characters in all)", system.name, most));
  return text;
}

std::string peer_text(const NodePeer& peer) {
  const std::uint32_t a = peer.address;
  return fmt::format("{}.{}.{}.{}:{}", a >> 24, (a >> 16) & 255u, (a >> 8) & 255u, a & 255u, peer.port);
}

std::uint64_t unguessable_number() {
  std::uint64_t number = 0;
  while (number == 0)
    if (::getrandom(&number, sizeof number, 0) != sizeof number) number = 0;
  return number;
}

std::int32_t to_microvolts(double volts) noexcept {
  const double most = 1e-6 * std::numeric_limits<std::int32_t>::max();
  if (!(std::abs(volts) <= most)) return std::numeric_limits<std::int32_t>::min();
  return static_cast<std::int32_t>(std::lround(1e6 * volts));
}

}  // namespace solenoid
