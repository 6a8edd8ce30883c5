// The header that stands before each sample of DDS and says how what follows is encoded, and how
// large a sample of a known size is in each encoding (RTPS 2.5, 10.2; DDS-XTypes 1.3, 7.6.2).
#pragma once

#include <cstddef>
#include <span>

namespace arbiter::gateway {

inline constexpr std::size_t kEncapsulationBytes = 4;

enum class Encoding { kUnknown, kXcdr1, kXcdr2 };
struct Encapsulation {
  Encoding encoding = Encoding::kUnknown;
  bool is_big_endian = false;
  // The fields follow each other, without headers between them. An appendable type of XCDR2 begins
  // with its length, a mutable one has a header before each field.
  bool is_plain = false;
  // Of the bytes behind it the last ones, up to 3, that are none of the sample's: what stands there
  // is no field. Who does not say it says 0.
  std::size_t padding = 0;
};
// Of a sample, or of its beginning.
[[nodiscard]] Encapsulation read_encapsulation(std::span<const std::byte> sample) noexcept;

// RTPS counts in fours: a sample is padded up to there.
[[nodiscard]] constexpr std::size_t padded(std::size_t size) noexcept {
  return (size + 3) & ~std::size_t{3};
}

// How many of so many bytes behind such a header are the sample's. What is not padded has nothing
// to take away, whatever was said of it when it was.
[[nodiscard]] constexpr std::size_t data_bytes(const Encapsulation& encapsulation,
                                               std::size_t bytes) noexcept {
  const bool is_padded = bytes == padded(bytes) && bytes >= encapsulation.padding;
  return is_padded ? bytes - encapsulation.padding : bytes;
}

// Whether so many bytes behind such a header may be a sample of a type that has `size` of them in
// plain CDR, neither more nor less. Other encodings add bytes of their own.
[[nodiscard]] constexpr bool may_have(const Encapsulation& encapsulation, std::size_t bytes,
                                      std::size_t size) noexcept {
  const std::size_t data = data_bytes(encapsulation, bytes);
  if (!encapsulation.is_plain) return data >= size;
  return data == size || (encapsulation.padding == 0 && bytes == padded(size));
}

}  // namespace arbiter::gateway
