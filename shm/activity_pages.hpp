// Which page has a source's activity, and where a process finds it.
//
// A source keeps its page for as long as one user after the other has it open who is the same. A
// page that another user could write is never anybody else's: he may have kept it mapped. So the
// daemon makes a new one, with the next number, which all who read the source map beside the old
// one; and then, in one step, it carries the activity on and puts the new page in force
// (TableWriter::change_page). Who has not mapped it by then finds none, and is blind until it has.
#pragma once

#include <array>
#include <cstdint>

#include "shm/activity.hpp"
#include "shm/atomic.hpp"
#include "shm/ids.hpp"
#include "shm/limits.hpp"

namespace arbiter::shm {

// Counts the pages that a source has had; 0: none yet.
using PageNumber = std::uint32_t;

// On the board: which page of each source is in force. Written by the daemon alone.
struct PageNumbers {
  std::array<Atomic<PageNumber>, kMaxSources> numbers;

  // SYNC POINT: page-in-force. Acquire; pairs with the release in TableWriter::change_page(): who
  // sees a page in force sees the activity that was carried on to it.
  [[nodiscard]] PageNumber of(SourceId id) const noexcept {
    return numbers[id].load(std::memory_order_acquire);
  }
};

// Where a process finds the activity of each source: in two places for each, used in turn, so that
// the page in force and the one that comes next are there together.
//
// Thread safety: one thread attaches, any thread reads.
// Invariant: what find() returns stays mapped; once it is another page's, the page that it was is
// no longer in force, and a decision that has looked there does not count (TableReader::
// is_in_force).
class ActivityPages {
 public:
  ActivityPages() = default;
  // `in_force`: on the board; without it a source's first page stays in force.
  explicit ActivityPages(const PageNumbers* in_force) noexcept : in_force_(in_force) {}

  void attach(SourceId id, const Activity* activity) noexcept { attach(id, kFirst, activity); }
  // SYNC POINT: page-attached. The releases pair with the acquires in find() and in changes(): who
  // finds a page finds it mapped.
  void attach(SourceId id, PageNumber number, const Activity* activity) noexcept {
    Place& place = places_[number % 2];
    place.activities[id].store(activity, std::memory_order_relaxed);
    place.numbers[id].store(number, std::memory_order_release);
    changes_.store(changes_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }
  // The place where that page would go is about to be another's. Relaxed is enough: whose it was is
  // in force no longer, or has never been.
  void vacate(SourceId id, PageNumber number) noexcept {
    places_[number % 2].numbers[id].store(0, std::memory_order_relaxed);
  }

  // Another after each attach(): what was bound before must be bound again.
  // SYNC POINT: page-attached. Acquire; pairs with the release in attach(): who sees the change
  // finds the page.
  [[nodiscard]] std::uint64_t changes() const noexcept {
    return changes_.load(std::memory_order_acquire);
  }
  // The page in force, or null where it is not here.
  [[nodiscard]] const Activity* find(SourceId id) const noexcept {
    if (id >= kMaxSources) return nullptr;
    const PageNumber number = in_force_ == nullptr ? kFirst : in_force_->of(id);
    const Place& place = places_[number % 2];
    return place.number_of(id) == number ? place.activities[id].load(std::memory_order_relaxed)
                                         : nullptr;
  }
  // Whether that page is here, in force or not.
  [[nodiscard]] bool has(SourceId id, PageNumber number) const noexcept {
    return id < kMaxSources && places_[number % 2].number_of(id) == number;
  }
  // Whether any page of it is here, be it not the one in force.
  [[nodiscard]] bool knows(SourceId id) const noexcept {
    return id < kMaxSources && (places_[0].number_of(id) != 0 || places_[1].number_of(id) != 0);
  }

 private:
  static constexpr PageNumber kFirst = 1;

  struct Place {
    // SYNC POINT: page-attached. Acquire; pairs with the release in attach().
    [[nodiscard]] PageNumber number_of(SourceId id) const noexcept {
      return numbers[id].load(std::memory_order_acquire);
    }

    std::array<Atomic<PageNumber>, kMaxSources> numbers{};  // 0: nothing is here
    std::array<Atomic<const Activity*>, kMaxSources> activities{};
  };

  alignas(kCacheLine) Atomic<std::uint64_t> changes_{0};
  alignas(kCacheLine) const PageNumbers* in_force_ = nullptr;
  Place places_[2];
};

}  // namespace arbiter::shm
