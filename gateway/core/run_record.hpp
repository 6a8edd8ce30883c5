// When the process ran: since when what a middleware delivers now can have waited for it.
//
// One thread ticks; those that deliver ask. Between two ticks that come in time the process ran,
// and whatever had been received was delivered. Behind a gap it was not: what is delivered then may
// have waited since the tick before the gap, until all that waited is gone.
//
// When is it gone? It is a backlog of the gap's length at most, and a gateway delivers several
// times as fast as its publishers publish, or it would never keep up: a third of the gap is enough.
// Nor does it grow without bound, for the kernel keeps no more than a few MiB for a socket: half a
// second of running is enough for any gap. Neither depends on T. Time counts only while ticks come
// in time: a process that is stopped again, or starved, has not gone on delivering.
//
// Invariants, for what was received by this host at `r` and is delivered at `d`:
//   since(d) <= r. So with a deadline of since(d) + T nothing arrives that is older than T.
//   Where no gap was longer than 3/4 of T, since(d) + T > d: nothing fresh is late.
//
// Thread safety: tick() from one thread; since() from any, wait-free.
// Units: nanoseconds of CLOCK_MONOTONIC, given by the caller.
#pragma once

#include <algorithm>

#include "shm/activity.hpp"
#include "shm/atomic.hpp"

namespace arbiter::gateway {

class RunRecord {
 public:
  // Before the first tick: long ago for any T, and not so long that adding one overflows.
  static constexpr shm::Nanoseconds kNever = -shm::kMaxTime;
  static constexpr shm::Nanoseconds kLongestDrain = 500'000'000;

  // `next`: how long the caller then sleeps. A tick is in time up to one period behind that.
  void tick(shm::Nanoseconds now, shm::Nanoseconds next) noexcept {
    const shm::Nanoseconds last = last_.load(std::memory_order_relaxed);
    if (last != kNever && now - last > 2 * period_) note_gap(last, now);
    period_ = next;
    // SYNC POINT: tick-recorded (release): who sees this tick sees the gap before it.
    last_.store(now, std::memory_order_release);
  }

  // What is delivered at `now` has not waited for longer than since then.
  [[nodiscard]] shm::Nanoseconds since(shm::Nanoseconds now) const noexcept {
    // SYNC POINT: tick-recorded (acquire). The tick before a gap says the same as the gap.
    const shm::Nanoseconds last = last_.load(std::memory_order_acquire);
    if (now >= gone_at_.load(std::memory_order_relaxed)) return last;
    const shm::Nanoseconds since = since_.load(std::memory_order_relaxed);
    // A gap that began behind `now` says nothing of it: the caller itself was held up.
    return since <= now ? since : kNever;
  }

 private:
  void note_gap(shm::Nanoseconds last, shm::Nanoseconds now) noexcept {
    shm::Nanoseconds since = since_.load(std::memory_order_relaxed);
    // The process may have stopped right behind the last tick. What had not gone by then waits yet.
    if (last >= gone_at_.load(std::memory_order_relaxed)) since = last;
    since_.store(since, std::memory_order_relaxed);
    gone_at_.store(now + std::min((now - since) / 3, kLongestDrain), std::memory_order_relaxed);
  }

  // The ticking thread writes, others read.
  shm::Atomic<shm::Nanoseconds> last_{kNever};
  shm::Atomic<shm::Nanoseconds> since_{kNever};  // the tick before the last gap
  shm::Atomic<shm::Nanoseconds> gone_at_{0};     // when all that waited in that gap is gone
  shm::Nanoseconds period_ = 0;                  // the ticking thread's own
};

}  // namespace arbiter::gateway
