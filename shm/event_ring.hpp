// The events of an output port: written by its publisher, read by its taps, in two segments of
// which each side writes its own (event_segment.hpp, tap_segment.hpp).
//
// Thread safety: EventWriter belongs to the publisher's thread, EventReader to the tap's; they may
// be in different processes, and either may stop or die anywhere. Both sides are wait-free, and the
// writer never looks at what readers have read.
//
// Invariants
//  1. Event n lies at index n % shape.events of the ring; writing it takes the one there out.
//  2. A sample is kept while its entry stands in `kept`, at index sequence % shape.kept.
//  3. A tap reads a sample only while it holds it, and it holds it only if its entry still stood
//     there after the hold could be seen. (As in channel.hpp, with fence (b) in the place where the
//     publisher looks for a free slot.)
//  4. A tap reads only events from `first` on, which were written when the publisher heeded its
//     holds already.
#pragma once

#include <algorithm>
#include <cstdint>

#include "shm/atomic.hpp"
#include "shm/channel.hpp"
#include "shm/event_segment.hpp"
#include "shm/input_segment.hpp"

namespace arbiter::shm {

class EventWriter {
 public:
  explicit EventWriter(EventSegment& segment) noexcept
      : segment_(&segment), shape_(segment.header.shape) {}

  // A tap may read from the next event on. SYNC POINT: tap-joined. The release pairs with the
  // acquire in EventReader::join(): who finds its link finds `first`.
  void join(std::uint32_t place, std::uint64_t link) noexcept {
    segment_->places[place].first.store(next_, std::memory_order_relaxed);
    segment_->places[place].link.store(link, std::memory_order_release);
  }
  // Relaxed is enough: a fence (b) comes before what the tap held is used again.
  void leave(std::uint32_t place) noexcept {
    segment_->places[place].link.store(0, std::memory_order_relaxed);
  }

  // Keeps a sample; returns the slot of the one that gave way to it, or kNoSlot. Relaxed is enough:
  // the event that tells of the sample is written afterwards, with a release.
  [[nodiscard]] std::uint32_t keep(Entry sample) noexcept {
    Atomic<Entry>& entry = segment_->kept[sequence_of(sample) & (shape_.kept - 1)];
    const Entry before = entry.load(std::memory_order_relaxed);  // our own store
    entry.store(sample, std::memory_order_relaxed);
    return before == 0 ? kNoSlot : slot_of(before);
  }
  // Keeps none any more. Calls `evicted(slot)` for each.
  template <class Evicted>
  void keep_nothing(Evicted evicted) noexcept {
    for (std::uint32_t i = 0; i < shape_.kept; ++i) {
      const Entry before = segment_->kept[i].load(std::memory_order_relaxed);
      segment_->kept[i].store(0, std::memory_order_relaxed);
      if (before != 0) evicted(slot_of(before));
    }
  }

  // SYNC POINT: event-written. The release pairs with the acquire in EventReader::read(): who sees
  // the event's number sees what was stored before it, and the sample. SYNC POINT:
  // event-overwritten. The release fence pairs with the acquire fence there: who has read a word of
  // this event in the place of an older one sees the number changed.
  void write(const EventRecord& record, const SampleOrigin& origin = {}) noexcept {
    Event& event = segment_->events[next_ & (shape_.events - 1)];
    event.number.store(2 * next_ + 1, std::memory_order_relaxed);
    release_fence();
    const bool is_state = record.kind == EventKind::kState;
    event.time.store(record.time, std::memory_order_relaxed);
    event.sample.store(record.sample, std::memory_order_relaxed);
    event.activity.store(record.activity, std::memory_order_relaxed);
    event.generation.store(record.generation, std::memory_order_relaxed);
    std::uint64_t revision_and_kind = record.revision << 8 | static_cast<std::uint8_t>(record.kind);
    if (origin.publisher != 0) [[unlikely]] {
      revision_and_kind |= kHasOrigin;
      event.origin_publisher.store(origin.publisher, std::memory_order_relaxed);
      event.origin_sequence.store(origin.sequence, std::memory_order_relaxed);
    }
    event.revision_and_kind.store(revision_and_kind, std::memory_order_relaxed);
    event.accepted.store(is_state ? record.joined : record.masks.accepted,
                         std::memory_order_relaxed);
    event.discarded.store(record.masks.discarded, std::memory_order_relaxed);
    event.refused.store(record.masks.refused, std::memory_order_relaxed);
    event.blind.store(record.masks.blind, std::memory_order_relaxed);
    event.size.store(record.size, std::memory_order_relaxed);
    event.number.store(2 * next_, std::memory_order_release);
    ++next_;
  }

  [[nodiscard]] std::uint64_t next() const noexcept { return next_; }

 private:
  EventSegment* segment_;
  EventShape shape_;
  std::uint64_t next_ = 1;  // number of the next event
};

class EventReader {
 public:
  enum class Found : std::uint8_t { kNothing, kEvent, kGap };

  EventReader() = default;
  // `place`, below kMaxTaps, and `link`: as the publisher has given them. `shape`: checked.
  EventReader(const EventSegment& segment, const EventShape& shape, PortInstance publisher,
              std::uint32_t place, std::uint64_t link) noexcept
      : segment_(&segment), publisher_(publisher), place_(place), link_(link), shape_(shape) {}

  // Looks whether the publisher heeds us. SYNC POINT: tap-joined (see EventWriter::join()).
  bool join() noexcept {
    if (next_ != 0) return true;
    const TapPlace& place = segment_->places[place_];
    if (place.link.load(std::memory_order_acquire) != link_) return false;
    next_ = place.first.load(std::memory_order_relaxed);
    return next_ != 0;
  }

  // The next event, once joined. A gap: events were overtaken, `lost` grows by them, and `record`
  // is the last of them, after which it goes on. Bounded: a publisher that overtakes again and
  // again is given up for this call.
  [[nodiscard]] Found read(EventRecord& record, std::uint64_t& lost) noexcept {
    std::uint64_t next = next_;
    for (int tries = 0; tries < kMaxTries; ++tries) {
      const Event& event = segment_->events[next & (shape_.events - 1)];
      // SYNC POINT: event-written (see EventWriter::write()).
      std::uint64_t number = event.number.load(std::memory_order_acquire);
      if (number == 2 * next) {
        copy(event, record, origin_);
        acquire_fence();  // SYNC POINT: event-overwritten (see EventWriter::write())
        const std::uint64_t again = event.number.load(std::memory_order_relaxed);
        if (again == number) {
          const bool is_gap = next != next_;
          lost += next - next_ + (is_gap ? 1 : 0);
          next_ = next + 1;
          return is_gap ? Found::kGap : Found::kEvent;
        }
        number = again;
      } else if (number / 2 <= next) {
        // An older one, or this one is being written. Where we have jumped to, it is only not seen
        // yet: another time.
        return Found::kNothing;
      }
      // Overtaken: we go on far enough behind the newest that we know of to be left in peace.
      next = std::max(number / 2 - std::uint64_t{shape_.events} / 4 * 3, next + 1);
    }
    return Found::kNothing;
  }

  // Where the arrival began that read() gave last.
  [[nodiscard]] const SampleOrigin& origin() const noexcept { return origin_; }

  // Announces a hold on a sample that an event told of. False: it is not kept any more. SYNC POINT:
  // kept-sample-held. Fence (e) pairs with fence (b) in OutputCore::acquire_slot(). The release is
  // that of `slot-released`, as in ChannelReader::hold().
  [[nodiscard]] bool hold(Entry sample, Atomic<Hold>& word) const noexcept {
    word.store(make_hold(publisher_, slot_of(sample)), std::memory_order_release);
    full_fence();  // (e)
    const bool named = segment_->places[place_].link.load(std::memory_order_relaxed) == link_;
    const Atomic<Entry>& entry = segment_->kept[sequence_of(sample) & (shape_.kept - 1)];
    if (named && entry.load(std::memory_order_relaxed) == sample) return true;
    ChannelReader::release(word);
    return false;
  }

  [[nodiscard]] std::uint64_t next() const noexcept { return next_; }

 private:
  static constexpr int kMaxTries = 64;

  static void copy(const Event& event, EventRecord& record, SampleOrigin& origin) noexcept {
    const std::uint64_t revision_and_kind = event.revision_and_kind.load(std::memory_order_relaxed);
    record.kind = static_cast<EventKind>(revision_and_kind & (kHasOrigin - 1));
    record.revision = revision_and_kind >> 8;
    record.time = event.time.load(std::memory_order_relaxed);
    record.sample = event.sample.load(std::memory_order_relaxed);
    record.activity = event.activity.load(std::memory_order_relaxed);
    record.generation = event.generation.load(std::memory_order_relaxed);
    record.size = event.size.load(std::memory_order_relaxed);
    origin = {};
    if ((revision_and_kind & kHasOrigin) != 0) {
      origin = {event.origin_publisher.load(std::memory_order_relaxed),
                event.origin_sequence.load(std::memory_order_relaxed)};
    }
    record.joined = event.accepted.load(std::memory_order_relaxed);
    record.masks = {record.joined, event.discarded.load(std::memory_order_relaxed),
                    event.refused.load(std::memory_order_relaxed),
                    event.blind.load(std::memory_order_relaxed)};
  }

  const EventSegment* segment_ = nullptr;
  PortInstance publisher_ = 0;
  std::uint32_t place_ = 0;
  std::uint64_t link_ = 0;
  EventShape shape_;
  std::uint64_t next_ = 0;  // number of the next event; 0: not joined yet
  SampleOrigin origin_;
};

}  // namespace arbiter::shm
