#include "core/config/toml_depth.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr int most_parts = 32;

/// Walks over a text; what is in quotes and comments is passed whole.
class KeyScanner {
 public:
  KeyScanner(std::string_view text, const std::string& name) : rest_(text), name_(name) {}

  void scan() {
    while (!rest_.empty()) {
      const char c = rest_.front();
      if (c == '#')
        pass(rest_.find('\n'));
      else if (c == '"' || c == '\'')
        pass_quoted(c);
      else
        pass_plain(c);
    }
  }

 private:
  void pass(std::size_t size) {
    size = std::min(size, rest_.size());
    line_ += static_cast<int>(std::count(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(size), '\n'));
    rest_.remove_prefix(size);
  }

  void pass_plain(char c) {
    if (c == '.' && ++dots_ >= most_parts)
      throw ConfigError(fmt::format("{}:{}: a key of too many parts (allowed: at most {})", name_, line_, most_parts));
    const bool of_a_key =
        c == '.' || c == '_' || c == '-' || c == ' ' || c == '\t' || std::isalnum(static_cast<unsigned char>(c)) != 0;
    if (!of_a_key) dots_ = 0;
    pass(1);
  }

  void pass_quoted(char quote) {
    const bool lines = rest_.starts_with(std::string(3, quote));
    const std::string end(lines ? 3 : 1, quote);
    std::size_t at = end.size();
    for (; at < rest_.size() && !rest_.substr(at).starts_with(end); ++at) {
      if (!lines && rest_[at] == '\n') break;  // not valid: the parser will say so
      if (quote == '"' && rest_[at] == '\\') ++at;
    }
    at += end.size();
    for (int more = 0; lines && more < 2 && at < rest_.size() && rest_[at] == quote; ++more) ++at;  // are the string's
    pass(at);
  }

  std::string_view rest_;
  const std::string& name_;
  int line_ = 1, dots_ = 0;
};

}  // namespace

void require_short_keys(std::string_view text, const std::string& name) { KeyScanner(text, name).scan(); }

}  // namespace solenoid
