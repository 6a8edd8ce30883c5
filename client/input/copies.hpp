// Samples that are copied out of a publisher's memory instead of being read where they lie, because
// it is not known yet that this memory is allocated: a load from a hole would allocate it, and the
// receiver would pay, sample after sample.
//
// An honest publisher's samples are copied for as long as it takes the service thread to look how
// much of the segment is in use by now: another input port has just been connected to it.
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>

#include "client/peers.hpp"
#include "shm/limits.hpp"

namespace arbiter::detail {

// What lies in a slot's header, and the sample itself, in memory of our own.
struct CopiedSample {
  std::uint64_t sequence = 0;
  shm::Nanoseconds stamp = 0;
  std::uint64_t size = 0;
  const std::byte* data = nullptr;
};

class Copies {
 public:
  // The most that an untyped sample may have to be copied. A larger one waits until its place is
  // known to be allocated; what a typed port takes, its component has said itself.
  static constexpr std::uint64_t kMostCopied = std::uint64_t{16} << 20;

  // Copies what lies in a slot, to stay until that number is used again. False: there is no memory
  // for it, or it is too large. Two system calls.
  [[nodiscard]] bool copy(const OutputPeer& from, std::uint32_t slot, bool has_one_size,
                          std::uint32_t number, CopiedSample& sample) noexcept;
  // Where the sample began that was copied last by that number.
  [[nodiscard]] shm::SampleOrigin origin(std::uint32_t number) const noexcept {
    return origins_[number];
  }
  // Frees what is not in use.
  void forget(std::uint32_t number) noexcept { data_[number].reset(); }

 private:
  struct Free {
    void operator()(std::byte* data) const noexcept { std::free(data); }  // NOLINT: aligned_alloc()
  };
  std::array<std::unique_ptr<std::byte, Free>, shm::kMaxHeld> data_;
  std::array<shm::SampleOrigin, shm::kMaxHeld> origins_;
};

}  // namespace arbiter::detail
