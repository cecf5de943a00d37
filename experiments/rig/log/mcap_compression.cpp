#include "experiments/rig/log/mcap_compression.hpp"

#include <algorithm>
#include <memory>
#include <new>

#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

namespace solenoid {
namespace {

/// What a codec did with a piece: how much it took and gave, whether its frame ended, and its complaint.
struct CodecStep {
  std::size_t taken = 0, given = 0;
  bool ended = false;
  const char* problem = nullptr;
};

class ZstdDecoder {
 public:
  ZstdDecoder() : context_(ZSTD_createDCtx(), ZSTD_freeDCtx) {
    if (!context_) throw std::bad_alloc();
  }
  CodecStep step(std::string_view input, char* to, std::size_t room) {
    ZSTD_inBuffer in{input.data(), input.size(), 0};
    ZSTD_outBuffer out{to, room, 0};
    const std::size_t left = ZSTD_decompressStream(context_.get(), &out, &in);
    return {in.pos, out.pos, left == 0, ZSTD_isError(left) != 0u ? ZSTD_getErrorName(left) : nullptr};
  }

 private:
  std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context_;
};

class Lz4Decoder {
 public:
  Lz4Decoder() : context_(make(), LZ4F_freeDecompressionContext) {}
  CodecStep step(std::string_view input, char* to, std::size_t room) {
    std::size_t taken = input.size(), given = room;
    const std::size_t left = LZ4F_decompress(context_.get(), to, &given, input.data(), &taken, nullptr);
    return {taken, given, left == 0, LZ4F_isError(left) != 0u ? LZ4F_getErrorName(left) : nullptr};
  }

 private:
  static LZ4F_dctx* make() {
    LZ4F_dctx* context = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0u) throw std::bad_alloc();
    return context;
  }
  std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context_;
};

/// Memory grows with what really comes out, not with what a header claims.
template <class Decoder>
Decompressed decode(Decoder decoder, std::string_view input, std::size_t most_bytes) {
  constexpr std::size_t piece = 1 << 16;
  Decompressed out;
  std::size_t filled = 0;
  while (!out.whole && out.problem.empty()) {
    if (filled == out.bytes.size()) out.bytes.resize(std::min(most_bytes + 1, std::max(piece, 2 * filled)));
    const CodecStep step = decoder.step(input, out.bytes.data() + filled, out.bytes.size() - filled);
    input.remove_prefix(step.taken);
    filled += step.given;
    out.whole = step.ended && step.problem == nullptr;
    if (step.problem != nullptr)
      out.problem = step.problem;
    else if (filled > most_bytes)
      out.problem = fmt::format("more than the {} bytes it says", most_bytes);
    else if (step.taken == 0 && step.given == 0)
      break;  // the input is at its end, the frame is not
  }
  if (out.whole && !input.empty()) out.problem = "bytes behind its end";
  out.bytes.resize(std::min(filled, most_bytes));
  return out;
}

}  // namespace

bool is_compression(std::string_view name) { return name == "zstd" || name == "lz4"; }

Decompressed decompress(std::string_view compression, std::string_view input, std::size_t most_bytes) {
  return compression == "zstd" ? decode(ZstdDecoder(), input, most_bytes) : decode(Lz4Decoder(), input, most_bytes);
}

}  // namespace solenoid
