// What is published: bytes of varying number, which tell by themselves whether they are whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace arbiter::stress {

// A generator of decisions; the same seed makes the same ones.
class Random {
 public:
  explicit Random(std::uint64_t seed) noexcept : state_(seed * 2 + 1) {
    for (int i = 0; i < 4; ++i) next();
  }
  std::uint64_t next() noexcept {  // splitmix64
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }
  // Below `bound`.
  std::uint32_t below(std::uint32_t bound) noexcept {
    return static_cast<std::uint32_t>(next() % bound);
  }
  bool one_in(std::uint32_t n) noexcept { return below(n) == 0; }

 private:
  std::uint64_t state_;
};

struct SampleHead {
  std::uint64_t checksum;
  std::uint64_t number;  // counts the samples of a source, across its publishers
  std::uint32_t source;
  std::uint32_t incarnation;  // of the publisher
  std::uint64_t words;        // that follow
};

inline constexpr std::uint32_t kMaxWords = 40;
inline constexpr std::size_t kMaxSample = sizeof(SampleHead) + 8 * kMaxWords;

inline std::uint64_t checksum(const std::byte* bytes, std::size_t size) noexcept {
  std::uint64_t sum = size;
  for (std::size_t at = sizeof(std::uint64_t); at + 8 <= size; at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes + at, 8);
    sum = ((sum ^ word) * 0x9e3779b97f4a7c15) ^ (sum >> 29);
  }
  return sum;
}

inline std::size_t sample_size(std::uint64_t words) noexcept {
  return sizeof(SampleHead) + 8 * words;
}

inline void write_sample(std::byte* bytes, SampleHead head, Random& random) noexcept {
  const std::size_t size = sample_size(head.words);
  std::memcpy(bytes, &head, sizeof head);
  for (std::size_t at = sizeof head; at < size; at += 8) {
    const std::uint64_t word = random.next();
    std::memcpy(bytes + at, &word, 8);
  }
  head.checksum = checksum(bytes, size);
  std::memcpy(bytes, &head.checksum, sizeof head.checksum);
}

// Whether they are the bytes of one sample, whole; `head` is what it says of itself.
inline bool read_sample(const std::byte* bytes, std::size_t size, SampleHead& head) noexcept {
  if (size < sizeof head) return false;
  std::memcpy(&head, bytes, sizeof head);
  return head.words <= kMaxWords && size == sample_size(head.words) &&
         head.checksum == checksum(bytes, size);
}

}  // namespace arbiter::stress
