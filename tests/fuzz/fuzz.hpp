#pragma once

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

namespace solenoid::fuzz {

/// What the fuzzer made, as text.
inline std::string_view text_of(const std::uint8_t* bytes, std::size_t size) {
  return {reinterpret_cast<const char*>(bytes), size};
}

/// The same as a regular file that is on no disk.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes) : descriptor_(::memfd_create("fuzz", MFD_CLOEXEC)) {
    if (descriptor_ < 0 || ::write(descriptor_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
      std::abort();
  }
  ~MemoryFile() { ::close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  std::string path() const { return fmt::format("/proc/self/fd/{}", descriptor_); }

 private:
  int descriptor_;
};

/// Ends the program, which is a finding.
[[noreturn]] inline void find(const std::string& what) {
  std::fprintf(stderr, "FOUND %s\n", what.c_str());
  std::abort();
}

/// A reader returns, or refuses in one line of our own words, but for those of the input. Whatever else it throws is a
/// finding.
template <class Read>
void read_or_refuse(std::string_view input, const Read& read) {
  const auto own_words = [&](const std::string& said) {
    if (said.empty() || said.find('\n') != std::string::npos) find("a refusal of no or several lines: " + said);
    for (const char* foreign : {"[json.exception", "std::", "basic_string", "stod", "stoi", "vector::"})
      if (said.find(foreign) != std::string::npos && input.find(foreign) == std::string_view::npos)
        find("a refusal in a library's words: " + said);
  };
  try {
    read();
  } catch (const ConfigError& error) {
    own_words(error.what());
  } catch (const OutputError& error) {
    own_words(error.what());
  } catch (const std::exception& error) {
    find(std::string("an exception that is no refusal: ") + error.what());
  }
}

}  // namespace solenoid::fuzz
