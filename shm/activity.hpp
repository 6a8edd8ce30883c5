// Activity of a source (paper, section III): "recently delivered data".
//
// One 64-bit word tells it, so that one load and one signed compare test it. Times are readings of
// CLOCK_MONOTONIC in nanoseconds, below 2^62 (146 years).
//
//   word                    meaning                                  active at `now`
//   0 .. 2^62-1             activity ends at this time (arrival + T)  word > now
//   2^62 | arrival          active until deactivated (T = forever)    always
//   negative, 2^63 | time   deactivated at this time                  never
//
// Invariants
//  1. One writer: the component that has the source's output port open, or its successor; the
//     daemon while nobody has.
//  2. A value stands for one write: each kind carries its own time, so a reader that sees the same
//     value twice knows that nothing happened in between (decision.hpp rests on this).
//  3. Between two values that are not deactivations the source was active all the time, if `breaks`
//     is the same for both: the writer knows when its activity ends, whatever T it has come from.
#pragma once

#include <cstdint>

#include "shm/atomic.hpp"
#include "shm/ids.hpp"
#include "shm/limits.hpp"

namespace arbiter::shm {

using Nanoseconds = std::int64_t;  // a point on, or a span of, CLOCK_MONOTONIC
using ActivityWord = std::int64_t;

inline constexpr Nanoseconds kForever = INT64_MAX;  // as a timeout T
inline constexpr Nanoseconds kMaxTime =
    (std::int64_t{1} << 61) - 1;                             // of a clock, and of a finite T
inline constexpr Nanoseconds kDefaultTimeout = 500'000'000;  // T where no model says otherwise
inline constexpr ActivityWord kForeverFlag = std::int64_t{1} << 62;
inline constexpr ActivityWord kDeactivatedFlag = INT64_MIN;
inline constexpr ActivityWord kNeverActive = 0;

constexpr ActivityWord arrival(Nanoseconds at, Nanoseconds timeout) noexcept {
  return timeout == kForever ? (kForeverFlag | at) : at + timeout;
}
constexpr ActivityWord deactivation(Nanoseconds at) noexcept { return kDeactivatedFlag | at; }

constexpr bool is_active(ActivityWord word, Nanoseconds now) noexcept { return word > now; }

// True where the passing of time alone can change what the word says.
constexpr bool is_finite(ActivityWord word) noexcept { return word >= 0 && word < kForeverFlag; }

// True where the word was surely written after the clock read `now`, given the source's T.
constexpr bool is_newer_than(ActivityWord word, Nanoseconds timeout, Nanoseconds now) noexcept {
  if (word < 0) return (word & ~kDeactivatedFlag) > now;
  if (word >= kForeverFlag) return (word & ~kForeverFlag) > now;
  return timeout != kForever && word - timeout > now;
}

// Whether activity that nobody renews is over within T, as what an arrival has made is. What lasts
// for ever is not, nor what a page was made to say by no arrival.
constexpr bool ends_within(ActivityWord word, Nanoseconds timeout, Nanoseconds now) noexcept {
  return is_finite(word) && timeout != kForever && word - now <= timeout;
}

constexpr bool is_deactivation(ActivityWord word) noexcept { return word < 0; }

// What a deactivation makes of a word: once more changes nothing.
constexpr ActivityWord deactivated(ActivityWord word, Nanoseconds at) noexcept {
  return is_deactivation(word) ? word : deactivation(at);
}

// The arrival that wrote a word that is not a deactivation, given the source's T.
constexpr Nanoseconds arrival_of(ActivityWord word, Nanoseconds timeout) noexcept {
  if (word >= kForeverFlag) return word & ~kForeverFlag;
  return timeout == kForever ? word : word - timeout;
}

// The time of the arrival or deactivation that wrote a word, given the source's T. Of one that was
// never written it is below 0.
constexpr Nanoseconds time_of(ActivityWord word, Nanoseconds timeout) noexcept {
  if (is_deactivation(word)) return word & ~kDeactivatedFlag;
  return word == kNeverActive ? -1 : arrival_of(word, timeout);
}

// Since when a source is active, or was until the end or the deactivation that its word tells, by
// `began`; below 0: that is not known. What began later is not taken for its beginning.
constexpr Nanoseconds beginning_of(ActivityWord word, Nanoseconds began, Nanoseconds now) noexcept {
  constexpr Nanoseconds kUnknown = -1;
  if (word == kNeverActive || began <= 0 || began > now) return kUnknown;
  if (word >= kForeverFlag) return began <= (word & ~kForeverFlag) ? began : kUnknown;
  return began < (word & ~kDeactivatedFlag) ? began : kUnknown;
}

struct Activity {
  Atomic<ActivityWord> word{kNeverActive};
  Atomic<std::uint64_t> breaks{0};  // how often an arrival has found the source inactive
  // The time of the last arrival that has; 0: not known, or what it began was over when the source
  // was deactivated. For people: no decision reads it.
  Atomic<Nanoseconds> began{0};

  // By the one writer, at `now`; what the word must come before, a fence of its orders. `begins`:
  // it is an arrival that finds the source inactive.
  // SYNC POINT: activity-written. The release, and the order of the two stores, pair with the
  // acquires in SeenActivity::of(): who sees the word sees the break before it, and the model that
  // was in force for its writer. Who sees the word sees that beginning, or a later one.
  void write(ActivityWord next, bool begins, Nanoseconds now) noexcept {
    if (begins) {
      breaks.store(breaks.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      // Just before it the source was inactive, but where the last activity ended at this very
      // time.
      const Nanoseconds end = word.load(std::memory_order_relaxed) & ~kDeactivatedFlag;
      began.store(end < now ? now : 0, std::memory_order_relaxed);
    }
    word.store(next, std::memory_order_release);
  }

  // By the one writer, whose source is deactivated at `now`. Once more changes nothing: since when
  // it is so stays known. Where the source was not active, what had begun ended before.
  void deactivate(Nanoseconds now) noexcept {
    const ActivityWord before = word.load(std::memory_order_relaxed);
    if (is_deactivation(before)) return;
    if (!is_active(before, now)) forget_beginning();
    write(deactivation(now), false, now);
  }

  // By the one writer: the time of the last arrival was somebody's choice.
  void forget_beginning() noexcept { began.store(0, std::memory_order_relaxed); }

  // By the daemon, into a page that nobody reads yet, from one whose owner is gone, or should be:
  // what he writes after this counts no more.
  void carry_on(const Activity& before) noexcept {
    breaks.store(before.breaks.load(std::memory_order_relaxed), std::memory_order_relaxed);
    began.store(before.began.load(std::memory_order_relaxed), std::memory_order_relaxed);
    word.store(before.word.load(std::memory_order_relaxed), std::memory_order_relaxed);
  }
};

// The page that the daemon makes for each source; a page, because that is what the kernel protects.
// Where in its page an activity lies depends on the source: at one place in all pages, they would
// compete for the few cache lines that the address's low bits lead to.
struct alignas(kPageSize) ActivityPage {
  struct alignas(kCacheLine) Place {
    Activity activity;
  };
  static constexpr std::size_t kPlaces = kPageSize / kCacheLine;

  [[nodiscard]] Activity& of(SourceId source) noexcept { return places[source % kPlaces].activity; }
  [[nodiscard]] const Activity& of(SourceId source) const noexcept {
    return places[source % kPlaces].activity;
  }

  Place places[kPlaces];
};
static_assert(sizeof(ActivityPage) == kPageSize);

}  // namespace arbiter::shm
