// Numbers as they stand in messages: little-endian, anywhere in memory.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace arbiter::link {

static_assert(std::endian::native == std::endian::little, "messages are copied as they stand");

// The caller has seen to it that sizeof(Number) bytes are there.
template <class Number>
[[nodiscard]] Number get(const std::byte* from) noexcept {
  static_assert(std::is_unsigned_v<Number>);
  Number number{};
  std::memcpy(&number, from, sizeof number);
  return number;
}

template <class Number>
void put(std::byte* to, Number number) noexcept {
  static_assert(std::is_unsigned_v<Number>);
  std::memcpy(to, &number, sizeof number);
}

}  // namespace arbiter::link
