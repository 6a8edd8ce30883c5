// The second of two copies of a sample: into Arbiter's memory, block by block, each from the first
// copy while it is in the cache.
//
// The first copy is sent next; this one nobody is known to read soon. So the copy of a large sample
// goes past the caches: no line is fetched only to be overwritten, and nothing that is needed is
// pushed out. Where the processor is not an x86-64, it is a copy like any other.
//
// Thread safety: one thread, which may tell others of the copy once this has ended. Does not wait.
#pragma once

#include <cstddef>

#include <arbiter/bytes.hpp>

namespace arbiter::gateway {

class SecondCopy {
 public:
  // Of a block, in bytes. Not smaller: a copy that gcc knows to be of at most 8 KiB it writes as
  // one instruction, rep movsq, which is slower than the C library (docs/performance.md).
  static constexpr std::size_t kBlock = std::size_t{16} << 10;
  // Samples from here on go past the caches, in bytes.
  static constexpr std::size_t kSmallestStream = std::size_t{256} << 10;

  explicit SecondCopy(WritableBytes to) noexcept
      : to_(to), is_stream_(to.size() >= kSmallestStream) {}
  SecondCopy(const SecondCopy&) = delete;
  SecondCopy& operator=(const SecondCopy&) = delete;
  ~SecondCopy();

  // The sample's bytes from `at` on, which lie within it.
  void add(std::size_t at, Bytes block) const noexcept;

 private:
  const WritableBytes to_;
  const bool is_stream_;
};

}  // namespace arbiter::gateway
