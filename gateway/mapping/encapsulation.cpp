#include "gateway/mapping/encapsulation.hpp"

namespace arbiter::gateway {

Encapsulation read_encapsulation(std::span<const std::byte> sample) noexcept {
  if (sample.size() < kEncapsulationBytes || sample[0] != std::byte{0}) return {};
  const auto kind = std::to_integer<unsigned>(sample[1]);
  const bool is_big_endian = (kind & 1U) == 0;
  const auto padding = std::to_integer<std::size_t>(sample[3] & std::byte{3});
  if (kind <= 0x03) {  // CDR, PL_CDR
    return {Encoding::kXcdr1, is_big_endian, kind <= 0x01, padding};
  }
  if (kind >= 0x06 && kind <= 0x0b) {  // CDR2, D_CDR2, PL_CDR2
    return {Encoding::kXcdr2, is_big_endian, kind <= 0x07, padding};
  }
  return {};
}

}  // namespace arbiter::gateway
