// Which bit of an event's masks is which input port: lists by revision, of which the last ones are
// kept.
//
// The publisher's service thread writes a list before it offers the view with which it counts; so
// an event that names a revision comes after its list. A list that is overwritten while it is read
// is noticed, as is one that is gone: the tap then does not know the names.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "shm/atomic.hpp"
#include "shm/event_segment.hpp"

namespace arbiter::shm {

struct Destination {
  PortId port = kNone;
  std::string name;

  friend bool operator==(const Destination& one, const Destination& other) {
    return one.port == other.port && one.name == other.name;
  }
  friend bool operator!=(const Destination& one, const Destination& other) {
    return !(one == other);
  }
};
using Destinations = std::vector<Destination>;  // by bit

// SYNC POINT: destinations-overwritten. The release fence pairs with the acquire fence in
// read_destinations(): who has read a word of this list in the place of an older one sees that the
// revision has changed. That the list is whole, who reads an event of its revision knows: both
// threads of the publisher (`view-offered`) and the event (`event-written`) pass it on.
inline void write_destinations(EventSegment& segment, std::uint64_t revision,
                               const Destinations& destinations) noexcept {
  constexpr std::size_t kWords = DestinationList::kNameWords;
  DestinationList& list = segment.lists[revision % segment.header.shape.lists];
  list.revision.store(2 * revision + 1, std::memory_order_relaxed);
  release_fence();
  list.count.store(destinations.size(), std::memory_order_relaxed);
  for (std::size_t i = 0; i < destinations.size() && i < kMaxDestinations; ++i) {
    const std::string& name = destinations[i].name;
    std::array<std::uint64_t, kWords> words{};
    std::memcpy(words.data(), name.data(),
                name.size() < kMaxNameLength ? name.size() : kMaxNameLength);
    list.destinations[i].port.store(destinations[i].port, std::memory_order_relaxed);
    // A name ends with the first word that has a zero.
    for (std::size_t word = 0; word <= name.size() / sizeof words[0] && word < kWords; ++word) {
      list.destinations[i].name[word].store(words[word], std::memory_order_relaxed);
    }
  }
  list.revision.store(2 * revision, std::memory_order_relaxed);
}

// False: the list of that revision is gone, or never was. Bounded by kMaxDestinations names of
// kMaxNameLength bytes, whatever the segment says. The names may be any bytes.
[[nodiscard]] inline bool read_destinations(const EventSegment& segment, const EventShape& shape,
                                            std::uint64_t revision, Destinations& destinations) {
  constexpr std::size_t kWords = DestinationList::kNameWords;
  const DestinationList& list = segment.lists[revision % shape.lists];
  if (list.revision.load(std::memory_order_relaxed) != 2 * revision) return false;
  const std::uint64_t count = list.count.load(std::memory_order_relaxed);
  destinations.resize(count < kMaxDestinations ? count : kMaxDestinations);
  for (std::size_t i = 0; i < destinations.size(); ++i) {
    std::array<char, sizeof(std::uint64_t) * kWords> name{};
    std::size_t length = 0;
    for (std::size_t word = 0; word < kWords && length == word * sizeof(std::uint64_t); ++word) {
      const std::uint64_t bytes = list.destinations[i].name[word].load(std::memory_order_relaxed);
      std::memcpy(&name[length], &bytes, sizeof bytes);
      length += strnlen(&name[length], sizeof bytes);
    }
    destinations[i] = {
        static_cast<PortId>(list.destinations[i].port.load(std::memory_order_relaxed)),
        std::string(name.data(), length)};
  }
  acquire_fence();  // SYNC POINT: destinations-overwritten (see write_destinations())
  return list.revision.load(std::memory_order_relaxed) == 2 * revision;
}

}  // namespace arbiter::shm
