#include "gateway/core/second_copy.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace arbiter::gateway {
namespace {

// No two lines are equal.
std::vector<std::byte> sample_of(std::size_t size) {
  std::vector<std::byte> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * 7 + (i >> 6));
  return bytes;
}

constexpr std::byte kUntouched{0xee};
constexpr std::size_t kRoom = 128;  // before and behind

// In blocks of that size, to memory that begins so far behind a line; and what it did elsewhere.
void expect_copied(std::size_t size, std::size_t block, std::size_t behind_line) {
  SCOPED_TRACE(std::to_string(size) + " bytes by " + std::to_string(block) + " to " +
               std::to_string(behind_line) + " behind a line");
  const std::vector<std::byte> sample = sample_of(size);
  std::vector<std::byte> memory(kRoom + 64 + size + kRoom, kUntouched);
  const std::size_t line = 64 - reinterpret_cast<std::uintptr_t>(memory.data()) % 64;
  const std::size_t begin = line + 64 + behind_line;
  {
    const SecondCopy copy({memory.data() + begin, size});
    for (std::size_t at = 0; at < size; at += block) {
      copy.add(at, {sample.data() + at, std::min(block, size - at)});
    }
  }
  std::vector<std::byte> expected(memory.size(), kUntouched);
  std::copy(sample.begin(), sample.end(), expected.begin() + static_cast<std::ptrdiff_t>(begin));
  EXPECT_TRUE(memory == expected);
}

TEST(SecondCopy, IsTheSampleAndNoByteMore) {
  constexpr std::size_t kLarge = SecondCopy::kSmallestStream;
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, kLarge - 1, kLarge, kLarge + 77}) {
    for (const std::size_t block : {SecondCopy::kBlock, std::size_t{1471}, std::size_t{63}}) {
      for (const std::size_t behind_line : {0U, 1U, 8U, 63U})
        expect_copied(size, block, behind_line);
    }
  }
}

}  // namespace
}  // namespace arbiter::gateway
