#include "core/config/one_line.hpp"

#include <iterator>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::string_view between = " ... ";
constexpr std::size_t longest = 1'900, from_the_end = 700, from_the_front = longest - from_the_end - between.size();

bool is_control(unsigned char c) { return c < 0x20 || c == 0x7f; }

/// U+0080 to U+009F in UTF-8.
bool is_long_control(std::string_view text) {
  return text.size() > 1 && text[0] == '\xc2' && static_cast<unsigned char>(text[1]) >= 0x80 &&
         static_cast<unsigned char>(text[1]) < 0xa0;
}

std::string escaped(std::string_view text) {
  std::string out;
  const auto escape = [&](char c) {
    fmt::format_to(std::back_inserter(out), "\\x{:02x}", static_cast<unsigned char>(c));
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (is_long_control(text.substr(i))) {
      escape(text[i]);
      escape(text[++i]);
    } else if (is_control(static_cast<unsigned char>(text[i]))) {
      escape(text[i]);
    } else {
      out += text[i];
    }
  }
  return out;
}

}  // namespace

std::string one_line(std::string_view text) {
  std::string out = escaped(text);
  if (out.size() > longest) out.replace(from_the_front, out.size() - from_the_front - from_the_end, between);
  return out;
}

}  // namespace solenoid
