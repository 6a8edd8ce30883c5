// A sample on its way through Cyclone: bytes as RTPS carries them, of whatever type they are.
//
// The first four bytes are the encapsulation header: two that say how the rest is encoded, and two
// of options. What arrives is not copied here: it lies in Cyclone's receive buffers, perhaps in
// several fragments, and is copied from there straight to where it goes (arrived_sample.hpp). What
// leaves is copied once, behind the Payload, and sent from there, again where a reader asks for it.
//
// Memory comes from a pool and goes back to it, so that nothing is allocated for each sample once
// as many have been on their way at once as there are.
//
// Thread safety: the pool may be used from any thread. A payload that leaves does not change once
// Cyclone has it.
#pragma once

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>

#include "gateway/mapping/encapsulation.hpp"

struct nn_rdata;

namespace arbiter::gateway::dds {

struct Payload {
  ddsi_serdata cyclone;     // first: Cyclone knows a payload by this
  std::uint32_t size = 0;   // with the encapsulation header
  std::uint8_t shelf = 0;   // of the pool
  Payload* next = nullptr;  // in the pool
  // Of what arrives: valid while Cyclone delivers it. Null: the bytes stand behind this.
  const nn_rdata* fragments = nullptr;

  [[nodiscard]] std::byte* bytes() noexcept { return reinterpret_cast<std::byte*>(this + 1); }
  [[nodiscard]] const std::byte* bytes() const noexcept {
    return reinterpret_cast<const std::byte*>(this + 1);
  }
};

[[nodiscard]] inline Payload* payload_of(ddsi_serdata* data) noexcept {
  return reinterpret_cast<Payload*>(data);
}
[[nodiscard]] inline const Payload* payload_of(const ddsi_serdata* data) noexcept {
  return reinterpret_cast<const Payload*>(data);
}

class PayloadPool {
 public:
  // The only one, and never destroyed: Cyclone gives payloads back when it likes, even after the
  // last of our entities has gone.
  [[nodiscard]] static PayloadPool& of_process();

  // With room for that many bytes behind it; null: no memory, or too large for RTPS.
  [[nodiscard]] Payload* take(std::size_t bytes) noexcept;
  void give_back(Payload* payload) noexcept;

 private:
  // Payloads with room for 64 bytes, 128, 256 … 2 GiB.
  static constexpr std::size_t kShelves = 26;
  static constexpr std::size_t kSmallest = 64;
  // What a shelf keeps is bounded, so that a burst does not hold memory for ever: so many bytes, or
  // two payloads that are not huge.
  static constexpr std::size_t kKeptBytes = std::size_t{8} << 20;
  static constexpr std::size_t kHuge = std::size_t{128} << 20;
  struct Shelf {
    std::mutex mutex;
    Payload* first = nullptr;
    std::size_t kept = 0;
  };

  [[nodiscard]] static std::size_t shelf_for(std::size_t bytes) noexcept;

  std::array<Shelf, kShelves> shelves_;
};

}  // namespace arbiter::gateway::dds
