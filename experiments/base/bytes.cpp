#include "experiments/base/bytes.hpp"

#include <zlib.h>

namespace solenoid {

std::uint32_t crc32(std::string_view bytes, std::uint32_t crc) noexcept {
  return static_cast<std::uint32_t>(::crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace solenoid
