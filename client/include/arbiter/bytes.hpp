// Views of bytes, for ports without a C++ type: C++17's lack of std::span made good. Each converts
// to a std::span.
//
// Units: bytes. Threads: a view is a value, and owns nothing: what it shows is there for as long as
// the sample or loan that gave it. Cost: a pointer and a size. Errors: none; as with a pointer,
// what lies outside is not looked after. The paper has nothing of it.
#pragma once

#if __cplusplus < 201703L
#error "arbiter needs C++17 or later: compile with -std=c++17, or set CXX_STANDARD to 17"
#endif

#include <cstddef>

#if __cplusplus >= 202002L
#include <ranges>
#endif

namespace arbiter {

template <class Byte>
class BasicBytes {
 public:
  using value_type = std::byte;
  using iterator = Byte*;

  constexpr BasicBytes() noexcept = default;
  constexpr BasicBytes(Byte* data, std::size_t size) noexcept : data_(data), size_(size) {}
  // A writable view is a readable one too.
  template <class Other, class = decltype(static_cast<Byte*>(static_cast<Other*>(nullptr)))>
  constexpr BasicBytes(const BasicBytes<Other>& other) noexcept  // NOLINT: as for std::span
      : data_(other.data()), size_(other.size()) {}

  [[nodiscard]] constexpr Byte* data() const noexcept { return data_; }
  [[nodiscard]] constexpr std::size_t size() const noexcept { return size_; }
  [[nodiscard]] constexpr bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] constexpr Byte* begin() const noexcept { return data_; }
  [[nodiscard]] constexpr Byte* end() const noexcept { return data_ + size_; }
  [[nodiscard]] constexpr Byte& operator[](std::size_t i) const noexcept { return data_[i]; }

 private:
  Byte* data_ = nullptr;
  std::size_t size_ = 0;
};

using Bytes = BasicBytes<const std::byte>;
using WritableBytes = BasicBytes<std::byte>;

}  // namespace arbiter

#if __cplusplus >= 202002L
template <class Byte>
inline constexpr bool std::ranges::enable_borrowed_range<arbiter::BasicBytes<Byte>> = true;
template <class Byte>
inline constexpr bool std::ranges::enable_view<arbiter::BasicBytes<Byte>> = true;
#endif
