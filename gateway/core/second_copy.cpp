#include "gateway/core/second_copy.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

#if defined(__x86_64__)
#include <emmintrin.h>
#endif

namespace arbiter::gateway {
namespace {

#if defined(__x86_64__)

constexpr std::size_t kLine = 64;  // bytes; one that is written whole is not fetched

void stream_line(std::byte* to, const std::byte* from) noexcept {
  for (std::size_t at = 0; at < kLine; at += sizeof(__m128i)) {
    const __m128i word = _mm_loadu_si128(reinterpret_cast<const __m128i*>(from + at));
    _mm_stream_si128(reinterpret_cast<__m128i*>(to + at), word);
  }
}

void stream(std::byte* to, Bytes from) noexcept {
  const std::size_t before = -reinterpret_cast<std::uintptr_t>(to) % kLine;
  std::size_t at = std::min(before, from.size());
  std::memcpy(to, from.data(), at);
  for (; from.size() - at >= kLine; at += kLine) stream_line(to + at, from.data() + at);
  std::memcpy(to + at, from.data() + at, from.size() - at);
}

// Such stores are outside the order of others; not even a release holds them.
void end_stream() noexcept { _mm_sfence(); }

#else

void stream(std::byte* to, Bytes from) noexcept { std::memcpy(to, from.data(), from.size()); }
void end_stream() noexcept {}

#endif

}  // namespace

SecondCopy::~SecondCopy() {
  if (is_stream_) end_stream();
}

void SecondCopy::add(std::size_t at, Bytes block) const noexcept {
  if (is_stream_) {
    stream(to_.data() + at, block);
  } else {
    std::memcpy(to_.data() + at, block.data(), block.size());
  }
}

}  // namespace arbiter::gateway
