// What has happened at an output port, for those who watch it: its events, one after the other, in
// a segment of its own that all its taps read.
//
// The component that has the output port open makes the segment when the first tap comes, and is
// its one writer. Writing an event costs the same however many taps there are.
//
//   EventHeader                 what it is
//   TapPlace[kMaxTaps]          from which event on a tap may read
//   Entry[kMaxKept]             the samples that are kept for the taps
//   DestinationList[kMaxDestinationLists]  which bit of an event's masks is which input port
//   Event[kMaxEvents]           a ring
//
// A tap that is too slow is overtaken: it notices by the events' numbers (event_ring.hpp).
#pragma once

#include <cstddef>
#include <cstdint>

#include "shm/activity.hpp"
#include "shm/atomic.hpp"
#include "shm/ids.hpp"
#include "shm/limits.hpp"
#include "shm/output_segment.hpp"

namespace arbiter::shm {

enum class EventKind : std::uint8_t {
  kState = 1,     // what the source is like, when a tap joins: nothing has happened
  kSample,        // an arrival with a sample
  kSignal,        // an arrival without one
  kDeactivation,  // the source's activity was ended
  kDestinations,  // from here on masks count by another list
};
inline constexpr std::uint8_t kLastEventKind = 5;

// Of an arrival: the destinations at which it met that fate, each in one mask at most. Of a signal,
// to be accepted is to be the winner; of a sample, it is to have been put into the queue.
struct Masks {
  std::uint64_t accepted = 0;
  std::uint64_t discarded = 0;
  std::uint64_t refused = 0;  // the winner, but its queue is full or its connection refused
  std::uint64_t blind = 0;    // no decision: not all that the rules read could be seen
};

// An event as it is written and read.
struct EventRecord {
  EventKind kind = EventKind::kState;
  Nanoseconds time = 0;          // of the arrival or deactivation; of a state, of the last of them
  Entry sample = 0;              // {sequence of the last sample, its slot or kNoSampleSlot}
  std::uint64_t size = 0;        // bytes of the sample
  ActivityWord activity = 0;     // of the source, once this has happened
  std::uint64_t generation = 0;  // of the model by which it was decided
  std::uint64_t revision = 0;    // of the list of destinations; 0: there are none
  std::uint64_t joined = 0;      // of a state: the link of the tap for which it was written
  Masks masks;
};

// The event says where it began; others leave what an older one has said there.
inline constexpr std::uint64_t kHasOrigin = 0x80;

// No slot: of these there are fewer (kMaxSlots).
inline constexpr std::uint32_t kNoSampleSlot = 0xffff;
static_assert(kMaxSlots <= kNoSampleSlot);

// `number` is twice that of the event, and one more while it is being written.
struct alignas(2 * kCacheLine) Event {
  Atomic<std::uint64_t> number;
  Atomic<Nanoseconds> time;
  Atomic<Entry> sample;
  Atomic<ActivityWord> activity;
  Atomic<std::uint64_t> generation;
  Atomic<std::uint64_t> revision_and_kind;  // the kind in the lowest seven bits, then kHasOrigin
  Atomic<std::uint64_t> accepted;           // of a state: the tap's link
  Atomic<std::uint64_t> discarded;
  Atomic<std::uint64_t> refused;
  Atomic<std::uint64_t> blind;
  Atomic<std::uint64_t> size;
  Atomic<std::uint64_t> origin_publisher;  // only with kHasOrigin, as the next
  Atomic<std::uint64_t> origin_sequence;
};
static_assert(sizeof(Event) == 2 * kCacheLine);

struct alignas(kCacheLine) TapPlace {
  Atomic<std::uint64_t> link;   // whose it is: the number that the publisher has given to the tap
  Atomic<std::uint64_t> first;  // event that was written when its holds were heeded already
};

// `revision` is twice that of the list, and one more while it is being written. Names are copied by
// words, for they are read while they may be written.
struct DestinationList {
  static constexpr std::size_t kNameWords = (kMaxNameLength + 1) / sizeof(std::uint64_t);
  struct Destination {
    Atomic<std::uint64_t> port;  // id of the input port
    Atomic<std::uint64_t> name[kNameWords];
  };
  Atomic<std::uint64_t> revision;
  Atomic<std::uint64_t> count;
  Destination destinations[kMaxDestinations];
};

// How much of the segment is in use.
struct EventShape {
  std::uint32_t events = kMaxEvents;  // a power of two, as the next
  std::uint32_t kept = kMaxKept;
  std::uint32_t lists = kMaxDestinationLists;

  [[nodiscard]] bool is_sane() const noexcept {
    return events >= 4 && events <= kMaxEvents && (events & (events - 1)) == 0 && kept >= 1 &&
           kept <= kMaxKept && (kept & (kept - 1)) == 0 && lists >= 1 &&
           lists <= kMaxDestinationLists;
  }
};

struct EventHeader {
  static constexpr std::uint64_t kMagic = 0x31747665'74696272;
  static constexpr std::uint32_t kVersion = 2;

  std::uint64_t magic;
  std::uint32_t version;
  EventShape shape;
};

struct alignas(kPageSize) EventSegment {
  EventHeader header;
  TapPlace places[kMaxTaps];
  alignas(kCacheLine) Atomic<Entry> kept[kMaxKept];
  DestinationList lists[kMaxDestinationLists];
  Event events[kMaxEvents];

  // By its writer, before anybody else has it.
  void initialize(const EventShape& shape) noexcept {
    header.magic = EventHeader::kMagic;
    header.version = EventHeader::kVersion;
    header.shape = shape;
  }
  // The shape of a foreign segment, which its writer may change at any time: what is judged must be
  // what is used. One that is not sane: this is no event segment of this version.
  [[nodiscard]] EventShape checked_shape() const noexcept {
    const EventShape shape = header.shape;
    const bool is_one =
        header.magic == EventHeader::kMagic && header.version == EventHeader::kVersion;
    return is_one && shape.is_sane() ? shape : EventShape{0, 0, 0};
  }
};

}  // namespace arbiter::shm
