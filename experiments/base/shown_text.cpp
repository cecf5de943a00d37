#include "experiments/base/shown_text.hpp"

#include <iterator>

#include <fmt/format.h>

namespace solenoid {

std::string shown(std::string_view text) {
  constexpr std::size_t longest = 80;
  std::string out = "'";
  for (const char c : text.substr(0, longest)) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '\t')
      out += "\\t";
    else if (byte < 0x20 || byte >= 0x7f || c == '\\')
      fmt::format_to(std::back_inserter(out), "\\x{:02x}", byte);
    else
      out += c;
  }
  return out + (text.size() > longest ? "...'" : "'");
}

}  // namespace solenoid
