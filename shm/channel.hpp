// The queue of one connection: an output port's channel, written by the publisher and read by one
// input port, in two segments of which each side writes its own.
//
// Thread safety: ChannelWriter belongs to the publisher's thread, ChannelReader to the receiver's;
// they may be in different processes, and either may stop or die anywhere. Both sides are
// wait-free.
//
// Invariants
//  1. Entry n lies at index (n - first) % depth of the ring; storing it takes entry n - depth out.
//  2. A slot is written only while no receiver holds it, and no ring has an entry of it that its
//     receiver is not done with.
//  3. A receiver reads a slot only while it holds it, and it holds it only if the entry was still
//     in the ring after the hold could be seen.
//  4. A receiver reads only entries from `first` on, which the publisher stored when it had mapped
//     the receiver's holds already.
//
// Why 2 and 3 fit together: the receiver stores its hold, passes fence (c), and reads the entry
// again; the publisher overwrites the entry, passes fence (b), and reads the holds. Of the two
// fences one comes first: either the receiver sees the entry gone and lets go, or the publisher
// sees the hold and waits.
//
// And why a receiver's word is enough: what it is done with it reads only while it holds it, and it
// says so behind its hold. It looks at no entry twice; one that lies reads what nobody promises it.
#pragma once

#include <cstdint>

#include "shm/assertion.hpp"
#include "shm/atomic.hpp"
#include "shm/ids.hpp"
#include "shm/input_segment.hpp"
#include "shm/limits.hpp"
#include "shm/output_segment.hpp"
#include "shm/prefetch.hpp"

namespace arbiter::shm {

inline constexpr std::uint32_t kNoSlot = 0xffffffff;

class ChannelWriter {
 public:
  ChannelWriter() = default;
  ChannelWriter(const OutputSegment& segment, std::uint32_t index) noexcept
      : segment_(segment),
        index_(index),
        channel_(&segment.channel(index)),
        joins_(&segment.header().joins),
        accepted_(channel_->accepted.load(std::memory_order_relaxed)) {}

  // Begins a queue for `receiver`, whose holds are mapped by now.
  // SYNC POINT: channel-joined. The release pairs with the acquire in ChannelReader::join(): who
  // finds itself named finds `first` and `depth`.
  void join(PortInstance receiver, PortId port, std::uint32_t depth) noexcept {
    // Relaxed is enough: we alone write it.
    ARBITER_ASSERT(channel_->receiver.load(std::memory_order_relaxed) == 0,
                   "a queue begins where another has not ended");
    ring_ = segment_.ring(index_, receiver);
    depth_ = depth;
    next_ = 0;
    live_ = 0;
    channel_->first.store(accepted_ + 1, std::memory_order_relaxed);
    channel_->depth.store(depth, std::memory_order_relaxed);
    channel_->port.store(port, std::memory_order_relaxed);
    channel_->discarded.store(0, std::memory_order_relaxed);
    channel_->refused.store(0, std::memory_order_relaxed);
    channel_->receiver.store(receiver, std::memory_order_release);
    joins_->store(joins_->load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  // Ends it. Calls `evicted(slot)` for each entry that was in the queue. The receiver takes no new
  // hold from fence (b) of the next publish on; it sees itself gone when it reads `receiver` again.
  template <class Evicted>
  void leave(Evicted evicted) noexcept {
    // Relaxed is enough: fence (b) comes before the slots are used again.
    channel_->receiver.store(0, std::memory_order_relaxed);
    for (; live_ != 0; --live_) {
      next_ = (next_ == 0 ? depth_ : next_) - 1;
      evicted(slot_of(ring_[next_].load(std::memory_order_relaxed)));
    }
  }

  // Appends a sample; returns the slot of the one that gave way to it, or kNoSlot.
  // SYNC POINT: entry-stored. The release pairs with the acquire in ChannelReader::peek(): who sees
  // the entry sees the sample. Fence (b) must follow before the holds are read.
  [[nodiscard]] std::uint32_t push(std::uint32_t slot) noexcept {
    Atomic<Entry>& entry = ring_[next_];
    std::uint32_t evicted = kNoSlot;
    if (live_ == depth_) {
      evicted = slot_of(entry.load(std::memory_order_relaxed));  // our own store
    } else {
      ++live_;
    }
    entry.store(make_entry(++accepted_ & kSequenceMask, slot), std::memory_order_release);
    // SYNC POINT: backlog-counted. The release pairs with the acquire in
    // ChannelReader::backlog_end().
    channel_->accepted.store(accepted_, std::memory_order_release);
    if (++next_ == depth_) next_ = 0;
    return evicted;
  }

  // Takes out of the queue what the receiver is done with, by its own word, before newer samples
  // push it out. Calls `evicted(slot)` for each; the entries stay where they are.
  // SYNC POINT: entries-consumed. The acquire pairs with fence (c), behind which the receiver
  // tells: who finds an entry done with finds the hold on its slot, too, or the end of that hold.
  template <class Evicted>
  void forget(const Atomic<std::uint64_t>& consumed, Evicted evicted) noexcept {
    // More than were ever accepted is a lie, and nothing is forgotten for it.
    const std::uint64_t waiting = accepted_ - consumed.load(std::memory_order_acquire);
    for (; live_ > waiting; --live_) {
      const std::uint32_t oldest = next_ < live_ ? next_ + depth_ - live_ : next_ - live_;
      evicted(slot_of(ring_[oldest].load(std::memory_order_relaxed)));  // our own store
    }
  }

  // Whether `depth` samples wait, given the receiver's own word for how far it is. A receiver that
  // lies harms nobody else: it is refused samples, or overtaken.
  [[nodiscard]] bool is_full(std::uint64_t consumed) const noexcept {
    return accepted_ - consumed >= depth_ && consumed <= accepted_;
  }
  [[nodiscard]] std::uint64_t accepted() const noexcept { return accepted_; }
  [[nodiscard]] Channel& channel() const noexcept { return *channel_; }

 private:
  OutputSegment segment_;
  std::uint32_t index_ = 0;
  Channel* channel_ = nullptr;
  Atomic<Entry>* ring_ = nullptr;  // once joined
  Atomic<std::uint64_t>* joins_ = nullptr;
  std::uint64_t accepted_ = 0;
  std::uint32_t depth_ = 1;
  std::uint32_t next_ = 0;  // index of the next entry
  std::uint32_t live_ = 0;  // the newest entries since join() that are not forgotten, at most depth
};

class ChannelReader {
 public:
  enum class State : std::uint8_t { kUnjoined, kJoined, kLeft, kMisbehaved };

  ChannelReader() = default;
  ChannelReader(const OutputSegment& segment, PortInstance publisher, PortInstance self) noexcept
      : segment_(segment), publisher_(publisher), self_(self) {}

  // Looks whether the publisher has begun our queue. Cheap enough for every take.
  // SYNC POINT: channel-joined (see ChannelWriter::join()).
  bool join() noexcept {
    const std::uint64_t joins = segment_.header().joins.load(std::memory_order_acquire);
    if (joins == seen_joins_) return false;
    seen_joins_ = joins;
    for (std::uint32_t index = 0; index < kMaxDestinations; ++index) {
      const Channel& channel = segment_.channel(index);
      if (channel.receiver.load(std::memory_order_acquire) != self_) continue;
      depth_ = channel.depth.load(std::memory_order_relaxed);
      if (depth_ == 0 || depth_ > kMaxDepth) {
        state_ = State::kMisbehaved;
        return false;
      }
      next_ = first_ = channel.first.load(std::memory_order_relaxed) & kSequenceMask;
      channel_ = &channel;
      ring_ = segment_.ring(index, self_);
      position_ = 0;
      state_ = State::kJoined;
      return true;
    }
    return false;
  }

  // The oldest entry of the queue, or 0 if it is empty. `lost` grows by the entries that were
  // overtaken. Bounded: a publisher that overtakes again and again is given up for this call.
  [[nodiscard]] Entry peek(std::uint64_t& lost) noexcept {
    if (state_ != State::kJoined) return 0;
    for (int tries = 0; tries < kMaxTries; ++tries) {
      // SYNC POINT: entry-stored (see ChannelWriter::push()).
      const Entry entry = ring_[position_].load(std::memory_order_acquire);
      const std::uint64_t ahead = (sequence_of(entry) - next_) & kSequenceMask;
      if (ahead == 0) {
        if (slot_of(entry) < segment_.layout().slot_count) {
          prefetch_sample(entry);
          prefetch_next();
          return entry;
        }
        state_ = State::kMisbehaved;
        return 0;
      }
      if (ahead > kSequenceMask / 2) {  // an older one: nothing new yet
        nothing_new_ = entry;
        return 0;
      }
      // The rings of a channel lie over each other: behind the end of this queue, the next one's
      // entries. Relaxed is enough: who sees such an entry finds its receiver, too.
      if (channel_->receiver.load(std::memory_order_relaxed) != self_) {
        state_ = State::kLeft;
        return 0;
      }
      if (ahead % depth_ != 0) {
        state_ = State::kMisbehaved;
        return 0;
      }
      // Overtaken: the entry here is the newest, the oldest lies behind it.
      const std::uint64_t gone = ahead - depth_ + 1;
      lost += gone;
      next_ = (next_ + gone) & kSequenceMask;
      advance(1);
    }
    return 0;
  }

  // After peek() has found nothing: the word that changes when there is something, or when a queue
  // may have been begun, and what it says as long as there is not. Neither value ever comes back.
  struct Watch {
    const Atomic<std::uint64_t>* word;
    std::uint64_t seen;

    [[nodiscard]] bool is_unchanged() const noexcept {
      return word->load(std::memory_order_relaxed) == seen;
    }
  };
  [[nodiscard]] Watch watch() const noexcept {
    if (state_ == State::kJoined) return {&ring_[position_], nothing_new_};
    return {&segment_.header().joins, seen_joins_};
  }

  // Announces a hold on the entry that peek() gave. False: it was overtaken, or the queue has
  // ended. SYNC POINT: slot-held. Fence (c) pairs with fence (b) of publish().
  [[nodiscard]] bool hold(Entry entry, Atomic<Hold>& word) noexcept {
    // SYNC POINT: slot-released. Release as in release(): who sees this hold in the place of the
    // last one must know as well that we are done reading that one's slot.
    word.store(make_hold(publisher_, slot_of(entry)), std::memory_order_release);
    full_fence();  // (c)
    // Relaxed is enough for both: they come after the fence, in either order, and an entry that is
    // the same was seen with its sample by peek(), for entries never repeat.
    const bool named = channel_->receiver.load(std::memory_order_relaxed) == self_;
    if (named && ring_[position_].load(std::memory_order_relaxed) == entry) return true;
    release(word);
    if (!named) state_ = State::kLeft;
    return false;
  }

  // SYNC POINT: slot-released. The release pairs with the acquire in SlotPool::reclaim(): our reads
  // of the slot come before the publisher writes it again.
  static void release(Atomic<Hold>& word) noexcept { word.store(0, std::memory_order_release); }

  // Done with the entry that peek() gave, taken or not.
  void consume() noexcept {
    next_ = (next_ + 1) & kSequenceMask;
    advance(1);
  }
  // Done with that many entries, seen or not.
  void skip(std::uint64_t count) noexcept {
    next_ = (next_ + count) & kSequenceMask;
    advance(static_cast<std::uint32_t>(count % depth_));
  }
  // Says so to the publisher, in its lane. SYNC POINT: entries-consumed. Relaxed is enough behind a
  // hold, for fence (c) stands between. Behind a stamp that was peeked, and no hold, only the load
  // must stay before the store: each processor keeps them so, although the language does not say.
  void tell(Atomic<std::uint64_t>& consumed) const noexcept {
    consumed.store(this->consumed(), std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t consumed() const noexcept { return next_ - 1; }
  [[nodiscard]] std::uint64_t next() const noexcept { return next_; }

  // The sequence of the newest entry; all that came before a decision may be dropped by it, nothing
  // that came after. SYNC POINT: backlog-counted (see ChannelWriter::push()).
  [[nodiscard]] std::uint64_t backlog_end() const noexcept {
    return state_ == State::kJoined ? accepted() : next_ - 1;
  }
  // The same of a queue that may have ended: by now the channel may count for the next one, which
  // begins where this one ended, or where this one began, if nothing came to it. Relaxed is enough
  // for `first`: who sees what the next one has accepted sees where it began.
  [[nodiscard]] std::uint64_t last_end() const noexcept {
    if (state_ != State::kJoined && state_ != State::kLeft) return next_ - 1;
    const std::uint64_t end = accepted();
    // SYNC POINT: channel-joined (see ChannelWriter::join()).
    const PortInstance receiver = channel_->receiver.load(std::memory_order_acquire);
    const std::uint64_t first = channel_->first.load(std::memory_order_relaxed) & kSequenceMask;
    const bool may_be_ours = receiver == self_ || receiver == 0;
    return may_be_ours && first == first_ ? end : (first - 1) & kSequenceMask;
  }
  // Whether all that lies before that was this queue's, to be asked after it: no other has begun in
  // the segment since this one was joined; or one has, in this channel. Relaxed is enough: who sees
  // what another queue has accepted sees it begun. A second one that begins at this very moment may
  // be missed: then what the first one had is counted, too.
  [[nodiscard]] bool is_last_end_sure() const noexcept {
    if (state_ != State::kJoined && state_ != State::kLeft) return false;
    const std::uint64_t begun =
        segment_.header().joins.load(std::memory_order_relaxed) - seen_joins_;
    const std::uint64_t first = channel_->first.load(std::memory_order_relaxed) & kSequenceMask;
    return begun == 0 || (begun == 1 && first != first_);
  }
  // How many entries are not consumed, given that end: those that wait, and those that were
  // overtaken before they were looked at.
  [[nodiscard]] std::uint64_t unread(std::uint64_t end) const noexcept {
    const std::uint64_t count = (end + 1 - next_) & kSequenceMask;
    return count > kSequenceMask / 2 ? 0 : count;
  }
  // How many of them wait; at most the depth, whatever the publisher says.
  [[nodiscard]] std::uint64_t backlog(std::uint64_t end) const noexcept {
    const std::uint64_t count = unread(end);
    return count < depth_ ? count : depth_;
  }

  // The same, with those that were overtaken before they were looked at, and with one that its
  // publisher has stored and not lived to count. Of a publisher that is gone.
  [[nodiscard]] std::uint64_t left_behind() const noexcept {
    const std::uint64_t next_stored = (backlog_end() + 1) & kSequenceMask;
    const std::uint64_t count = (next_stored - next_) & kSequenceMask;
    if (count > kSequenceMask / 2) return 0;
    if (state_ != State::kJoined) return count;
    const Entry entry = ring_[(position_ + count) % depth_].load(std::memory_order_relaxed);
    return count + (sequence_of(entry) == next_stored ? 1 : 0);
  }

  // The arrival time of an entry that is not held, for ordering; sure only if the entry is still
  // there. SYNC POINT: stamp-peeked. The acquire fence keeps the second look at the entry behind
  // the load.
  [[nodiscard]] bool peek_stamp(Entry entry, Nanoseconds& stamp) const noexcept {
    stamp = segment_.slot_header(slot_of(entry)).stamp.load(std::memory_order_relaxed);
    acquire_fence();
    return ring_[position_].load(std::memory_order_relaxed) == entry;
  }

  [[nodiscard]] State state() const noexcept { return state_; }
  [[nodiscard]] const OutputSegment& segment() const noexcept { return segment_; }
  [[nodiscard]] PortInstance publisher() const noexcept { return publisher_; }

 private:
  static constexpr int kMaxTries = 64;

  // SYNC POINT: backlog-counted (see ChannelWriter::push()).
  [[nodiscard]] std::uint64_t accepted() const noexcept {
    return channel_->accepted.load(std::memory_order_acquire) & kSequenceMask;
  }

  // A sample's lines lie in the publisher's cache: let them come while we decide.
  void prefetch_sample(Entry entry) const noexcept {
    prefetch(&segment_.slot_header(slot_of(entry)));
    prefetch(segment_.payload(slot_of(entry)));
  }
  // And the next one's, if it is there, while this one is taken: fence (c) would keep them waiting.
  // Relaxed is enough for what is only a guess; and a guess harms nobody, whatever slot a publisher
  // that lies has named: nothing is read.
  void prefetch_next() const noexcept {
    const std::uint32_t position = position_ + 1 == depth_ ? 0 : position_ + 1;
    const Entry entry = ring_[position].load(std::memory_order_relaxed);
    if (sequence_of(entry) == ((next_ + 1) & kSequenceMask)) prefetch_sample(entry);
  }

  void advance(std::uint32_t by) noexcept {
    position_ += by;
    if (position_ >= depth_) position_ -= depth_;
  }

  const Channel* channel_ = nullptr;
  const Atomic<Entry>* ring_ = nullptr;
  std::uint64_t first_ = 1;     // sequence of the first entry
  std::uint64_t next_ = 1;      // of the oldest one that is not consumed
  std::uint32_t position_ = 0;  // its index
  std::uint32_t depth_ = 1;
  State state_ = State::kUnjoined;
  std::uint64_t seen_joins_ = 0;
  Entry nothing_new_ = 0;
  OutputSegment segment_;
  PortInstance publisher_ = 0;
  PortInstance self_ = 0;
};

}  // namespace arbiter::shm
