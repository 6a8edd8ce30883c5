// Which payload slots of an output port are free. Private to the publisher; nothing of it is
// shared.
//
// A slot goes round: free -> loaned -> in queues -> retired -> free. It is retired when the last
// ring entry of it is overwritten or forgotten, and becomes free once no receiver holds it.
//
// Invariant: with at least (sum of the queues' depths) + (sum of the receivers' max_held) + (loans)
// slots, acquire() always finds one: at worst every queue is full of samples of its own, every
// receiver holds as many others, and the other loans are out. What is kept for taps counts as a
// queue, and a tap as a receiver.
//
// Each slot is free, retired, named by a queue, or loaned, and only one of these. That is our own
// memory, so it is asserted, but not where publish() would pay for each slot that goes round: when
// the port ends, by require_balance().
#pragma once

#include <cstdint>
#include <vector>

#include "shm/assertion.hpp"
#include "shm/atomic.hpp"
#include "shm/channel.hpp"
#include "shm/event_segment.hpp"
#include "shm/input_segment.hpp"

namespace arbiter::shm {

class SlotPool {
 public:
  // Slots up to `count` may be used from now on.
  void grow(std::uint32_t count) {
    const auto before = static_cast<std::uint32_t>(references_.size());
    if (count <= before) return;
    references_.resize(count);
    make_room(free_, count);
    make_room(retired_, count);
    make_room(held_,
              std::size_t{kMaxHeld} * kMaxDestinations + std::size_t{kMaxTapHeld} * kMaxTaps);
    for (std::uint32_t slot = count; slot-- > before;) free_.push_back(slot);
  }

  // A free slot, or kNoSlot. `for_each_holds(f)` calls f(const Atomic<Hold>* holds, count) for
  // every receiver that may hold slots of `publisher`. A fence (b) stands between the last evict()
  // and this, or the slot was forgotten (ChannelWriter::forget()). `recent`: the one that was used
  // last, for it may be in the cache; else retired slots are looked at only where none is free.
  template <class ForEachHolds>
  [[nodiscard]] std::uint32_t acquire(PortInstance publisher, ForEachHolds for_each_holds,
                                      bool recent = false) {
    if (free_.empty() || (recent && !retired_.empty())) reclaim(publisher, for_each_holds);
    if (free_.empty()) return kNoSlot;
    const std::uint32_t slot = free_.back();
    free_.pop_back();
    return slot;
  }

  void add_reference(std::uint32_t slot) noexcept { ++references_[slot]; }
  // One queue has let go of the slot.
  void evict(std::uint32_t slot) {
    if (--references_[slot] == 0) retired_.push_back(slot);
  }
  // That no slot is lost and none is in two places, while no loan is out. Goes through all of them.
  void require_balance() const noexcept {
    std::uint64_t count = 0;
    std::uint64_t sum = 0;  // of their numbers
    const auto add = [&](std::uint64_t slot) {
      ++count;
      sum += slot;
    };
    for (const auto* list : {&free_, &retired_}) {
      for (const std::uint32_t slot : *list) {
        ARBITER_ASSERT(references_[slot] == 0, "a slot is free that a queue names");
        add(slot);
      }
    }
    for (std::size_t slot = 0; slot < references_.size(); ++slot) {
      if (references_[slot] != 0) add(slot);
    }
    const std::uint64_t all = references_.size();
    ARBITER_ASSERT(count == all && sum == all * (all - 1) / 2, "a slot is lost, or in two places");
  }
  // A loan ended: back to the free slots if no queue took it.
  void end_loan(std::uint32_t slot) {
    if (references_[slot] == 0) free_.push_back(slot);
  }

  [[nodiscard]] std::uint32_t size() const noexcept {
    return static_cast<std::uint32_t>(references_.size());
  }
  [[nodiscard]] std::size_t free_count() const noexcept { return free_.size(); }
  [[nodiscard]] std::size_t retired_count() const noexcept { return retired_.size(); }

 private:
  // Written, not only reserved: a later use must not be the memory's first.
  static void make_room(std::vector<std::uint32_t>& list, std::size_t capacity) {
    const std::size_t size = list.size();
    list.resize(capacity);
    list.resize(size);
  }

  // By itself: its registers would be saved by each call that finds a free slot at once.
  template <class ForEachHolds>
  [[gnu::noinline]] void reclaim(PortInstance publisher, ForEachHolds for_each_holds) {
    held_.clear();
    // Once for receivers and once for taps: a call for each would cost more than the look.
    const auto note = [&](const Atomic<Hold>* holds, std::uint32_t count)
        __attribute__((always_inline)) {
      for (std::uint32_t i = 0; i < count; ++i) {
        // SYNC POINT: slot-released (see ChannelReader::release()).
        const Hold hold = holds[i].load(std::memory_order_acquire);
        if (publisher_of(hold) == publisher) held_.push_back(slot_of(hold));
      }
    };
    for_each_holds(note);
    std::size_t kept = 0;
    for (const std::uint32_t slot : retired_) {
      bool held = false;
      for (const std::uint32_t other : held_) held = held || other == slot;
      if (held) {
        retired_[kept++] = slot;
      } else {
        free_.push_back(slot);
      }
    }
    retired_.resize(kept);
  }

  std::vector<std::uint32_t> references_;  // by slot: ring entries that name it
  std::vector<std::uint32_t> free_;
  std::vector<std::uint32_t> retired_;
  std::vector<std::uint32_t> held_;  // scratch
};

}  // namespace arbiter::shm
