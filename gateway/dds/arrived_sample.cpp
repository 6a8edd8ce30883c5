#include "gateway/dds/arrived_sample.hpp"

#include <cstring>

#include "gateway/dds/fragments.hpp"

namespace arbiter::gateway::dds {

Encapsulation read_encapsulation(Bytes header) noexcept {
  if (header.size() < kEncapsulationBytes || header[0] != std::byte{0}) return {};
  const auto kind = std::to_integer<unsigned>(header[1]);
  const bool is_big_endian = (kind & 1U) == 0;
  if (kind <= 0x03) return {Encoding::kXcdr1, is_big_endian, kind <= 0x01};  // CDR, PL_CDR
  if (kind >= 0x06 && kind <= 0x0b) {  // CDR2, D_CDR2, PL_CDR2
    return {Encoding::kXcdr2, is_big_endian, kind <= 0x07};
  }
  return {};
}

ArrivedSample::ArrivedSample(const Payload& payload) noexcept : payload_(payload) {
  if (payload.size >= kEncapsulationBytes &&
      ArrivedSample::copy(0, WritableBytes(header_.data(), header_.size()))) {
    encapsulation_ = read_encapsulation(Bytes(header_.data(), header_.size()));
  }
}

bool ArrivedSample::copy(std::size_t from, WritableBytes to) const noexcept {
  if (payload_.fragments != nullptr) return copy_fragments(payload_.fragments, from, to);
  std::memcpy(to.data(), payload_.bytes() + from, to.size());
  return true;
}

}  // namespace arbiter::gateway::dds
