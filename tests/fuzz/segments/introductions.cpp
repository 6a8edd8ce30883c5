// Hostile memory that is put before honest ports: as it should be, but for some words.
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <stdexcept>

#include "client/peers.hpp"
#include "client/types.hpp"
#include "tests/fuzz/segments/guarded_mapping.hpp"
#include "tests/fuzz/segments/world.hpp"

namespace arbiter::fuzz {

shm::FileDescriptor World::make_hostile(std::size_t size, const void* header,
                                        std::size_t header_size, const std::vector<Patch>& patches,
                                        const std::map<std::size_t, std::uint64_t>& words,
                                        bool is_allocated) {
  auto segment = shm::make_segment("hostile", size);
  if (is_allocated && shm::allocate(segment, 0, size)) die("no memory");
  std::vector<char> bytes(header_size);
  std::memcpy(bytes.data(), header, header_size);
  for (const Patch& patch : patches) {
    const std::size_t at = patch.word % (header_size / sizeof patch.value) * sizeof patch.value;
    std::memcpy(bytes.data() + at, &patch.value, sizeof patch.value);
  }
  const std::size_t used = std::min(header_size, size);
  if (::pwrite(segment.get(), bytes.data(), used, 0) != static_cast<ssize_t>(used)) die("pwrite");
  for (const auto& [at, value] : words) {
    if (at + 8 <= size && ::pwrite(segment.get(), &value, 8, static_cast<off_t>(at)) != 8) {
      die("pwrite");
    }
  }
  shm::seal(segment, shm::Seals::kOneWriter);
  declare_hostile(segment.get());
  return segment;
}

void World::introduce_output(std::uint32_t slots, int more, const std::vector<Patch>& patches) {
  const auto layout = shm::OutputLayout::plan(p.type(), slots);
  shm::OutputHeader header{};
  header.magic = shm::OutputHeader::kMagic;
  header.version = shm::OutputHeader::kVersion;
  header.slot_count = slots;
  header.type = p.type();
  wire::Received received;
  received.message.peer = ++last_instance_;
  received.message.id = h.source();
  received.message.link = ++last_link_;
  // A queue for /r, with a sample in the last slot.
  const std::size_t channel = layout.channels_offset;
  const std::map<std::size_t, std::uint64_t> words{
      {offsetof(shm::OutputHeader, joins), 1},
      {channel + offsetof(shm::Channel, first), 1},
      {channel + offsetof(shm::Channel, depth), 2},
      {channel + offsetof(shm::Channel, accepted), 1},
      {channel + offsetof(shm::Channel, receiver), received.message.link},
      {layout.rings_offset +
           received.message.link % (shm::kPageSize / shm::kCacheLine) * shm::kCacheLine,
       shm::make_entry(1, slots - 1)}};
  received.descriptors[0] =
      make_hostile(layout.total_size + static_cast<std::size_t>(more), &header,
                   offsetof(shm::OutputHeader, joins), patches, words);
  try {
    r.add_peer(detail::map_output_peer(received, p.type()));
  } catch (const std::runtime_error&) {  // it says what is wrong with it
  }
}

void World::introduce_input(const std::vector<Patch>& patches) {
  shm::InputHeader header{};
  header.magic = shm::InputHeader::kMagic;
  header.version = shm::InputHeader::kVersion;
  header.depth = 2;
  header.max_held = 2;
  header.type = p.type();
  wire::Received received;
  received.message.peer = ++last_instance_;
  received.message.id = x.port();
  received.message.flags = wire::kIsConnected;
  // It takes up whatever comes; what a step writes there later may say otherwise.
  received.descriptors[0] =
      make_hostile(sizeof(shm::InputSegment), &header, offsetof(shm::InputHeader, wait), patches,
                   {{offsetof(shm::InputHeader, newest_link), UINT64_MAX}});
  received.descriptors[1] = shm::duplicate(x.bell().write_end().get());
  try {
    p.add_peer(detail::map_input_peer(received, p.type()), ++last_link_);
  } catch (const std::runtime_error&) {
  }
}

void World::introduce_tap(const std::vector<Patch>& patches) {
  shm::TapSegment segment{};
  segment.magic = shm::TapSegment::kMagic;
  segment.version = shm::TapSegment::kVersion;
  segment.max_held = 1;
  segment.sleeps = 1;
  wire::Received received;
  received.message.peer = ++last_instance_;
  received.descriptors[0] =
      make_hostile(sizeof segment, &segment, offsetof(shm::TapSegment, wait), patches, {}, true);
  received.descriptors[1] = shm::duplicate(y.bell().write_end().get());
  try {
    p.add_tap(detail::map_tap_peer(received, shm::Residence::kMapped));
  } catch (const std::runtime_error&) {
  }
  show_growth(p);
}

void World::introduce_events(const std::vector<Patch>& patches) {
  shm::EventHeader header{};
  header.magic = shm::EventHeader::kMagic;
  header.version = shm::EventHeader::kVersion;
  header.shape = {4, 2, 2};
  wire::Received received;
  received.message.peer = ++last_instance_;
  received.message.id = h.source();
  received.message.link = ++last_link_;
  received.message.set_name("/h");
  // Joined, and a sample that is kept.
  const std::size_t event = offsetof(shm::EventSegment, events) + sizeof(shm::Event);
  const std::map<std::size_t, std::uint64_t> words{
      {offsetof(shm::EventSegment, places) + offsetof(shm::TapPlace, link), last_link_},
      {offsetof(shm::EventSegment, places) + offsetof(shm::TapPlace, first), 1},
      {offsetof(shm::EventSegment, kept) + sizeof(shm::Entry), shm::make_entry(1, 0)},
      {event + offsetof(shm::Event, sample), shm::make_entry(1, 0)},
      {event + offsetof(shm::Event, activity), shm::kForeverFlag},
      {event + offsetof(shm::Event, revision_and_kind),
       static_cast<std::uint64_t>(shm::EventKind::kSample)},
      {event + offsetof(shm::Event, number), 2}};
  received.descriptors[0] = shm::duplicate(h.segment_descriptor().get());
  received.descriptors[1] =
      make_hostile(sizeof(shm::EventSegment), &header, sizeof header, patches, words, true);
  try {
    t.add_source(detail::map_tap_source(received, p.type(), shm::Residence::kMapped));
  } catch (const std::runtime_error&) {
  }
}

}  // namespace arbiter::fuzz
