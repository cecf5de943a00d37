#include "core/config/whole_file.hpp"

#include "core/config/open_file.hpp"
#include "core/config/reader.hpp"

#include <algorithm>
#include <cerrno>
#include <new>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace solenoid {
namespace {

std::string size_text(std::size_t bytes) {
  return bytes < file_size::megabyte ? fmt::format("{} bytes", bytes)
                                     : fmt::format("{} MB", bytes / file_size::megabyte);
}

[[noreturn]] void refuse_size(const std::string& path, std::size_t most_bytes) {
  throw ConfigError(fmt::format("{}: is too large (allowed: at most {})", path, size_text(most_bytes)));
}

void require_regular(const std::string& path, mode_t mode) {
  const char* kind = S_ISFIFO(mode) ? "a pipe" : S_ISSOCK(mode) ? "a socket" : "a device";
  if (!S_ISREG(mode)) throw ConfigError(fmt::format("{}: is {} (allowed: a regular file)", path, kind));
}

/// To the end, whatever size the system tells: files of /proc have none, and others may grow. False if it cannot.
bool read_to_end(int descriptor, const std::string& path, std::size_t expected, std::size_t most_bytes,
                 std::string& text) {
  constexpr std::size_t piece = 65536;
  std::size_t filled = 0;
  text.resize(std::min(expected, most_bytes) + 1);  // one more finds the end
  for (;;) {
    if (filled > most_bytes) refuse_size(path, most_bytes);
    if (filled == text.size()) text.resize(text.size() + std::max(piece, text.size() / 2));
    const ssize_t n = ::read(descriptor, text.data() + filled, text.size() - filled);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return false;
    if (n == 0) break;
    filled += static_cast<std::size_t>(n);
  }
  text.resize(filled);
  return true;
}

}  // namespace

std::optional<std::string> read_whole_file(const std::string& path, std::size_t most_bytes) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || S_ISDIR(status.st_mode)) return std::nullopt;
  require_regular(path, status.st_mode);  // before it is opened: opening a device may do something
  const OpenFile file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (!file || ::fstat(file.descriptor(), &status) != 0) return std::nullopt;
  require_regular(path, status.st_mode);
  const auto size = static_cast<std::size_t>(status.st_size);
  if (size > most_bytes) refuse_size(path, most_bytes);
  try {
    std::string text;
    if (!read_to_end(file.descriptor(), path, size, most_bytes, text)) return std::nullopt;
    return text;
  } catch (const std::bad_alloc&) {
    throw ConfigError(fmt::format("{}: does not fit into memory (allowed: at most {})", path, size_text(most_bytes)));
  }
}

}  // namespace solenoid
