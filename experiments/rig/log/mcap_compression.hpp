#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace solenoid {

/// What became of a compressed chunk.
struct Decompressed {
  std::string bytes;
  bool whole = false;   ///< the frame's end was reached; otherwise the input was cut before it
  std::string problem;  ///< empty, or why the input is no such frame; `bytes` has what came before
};

/// Whether chunks may be compressed so: "zstd", "lz4" (frame format).
bool is_compression(std::string_view name);
/// Decompresses as far as the input goes and at most `most_bytes`, whatever the frame claims: beyond that is a problem.
Decompressed decompress(std::string_view compression, std::string_view input, std::size_t most_bytes);

}  // namespace solenoid
