#include "recording/crc32.hpp"

#include <zlib.h>

namespace arbiter::recording {

std::uint32_t crc32(std::string_view bytes, std::uint32_t before) noexcept {
  if (bytes.data() == nullptr) return before;  // zlib would begin again
  return static_cast<std::uint32_t>(
      ::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace arbiter::recording
