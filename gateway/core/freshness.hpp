// Never late: until when a sample that has come from outside may become an arrival.
//
// A middleware says when a sample was sent only by a clock that is not ours, or not at all. What
// can be known is for how long it can have waited in this host: no longer than since the gateway
// last found that nothing waited, or last ran. A gateway that was stopped or starved for longer
// than T discards what has waited meanwhile (docs/gateways.md).
//
// Units: nanoseconds of CLOCK_MONOTONIC, given by the caller, so that tests say what time it is.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "gateway/core/run_record.hpp"
#include "shm/activity.hpp"
#include "shm/atomic.hpp"

namespace arbiter::gateway {

// The longest that a sample of an entry may have waited: T of its source, or less (MaxAges). Of an
// entry with two sources, the shorter one; a sample of the other may be older. One writer, the
// gateway's loop; any thread reads.
class MaxAge {
 public:
  using OfPorts = std::array<shm::Nanoseconds, 2>;  // in the order of Entry::ports()

  void set(shm::Nanoseconds age, bool is_forever = false) noexcept { set({age, age}, is_forever); }
  // `is_known`: a model in force says so, rather than that T is not known.
  void set(const OfPorts& ages, bool is_forever, bool is_known = true) noexcept {
    const shm::Nanoseconds shortest = std::min(ages[0], ages[1]);
    age_.store(shortest, std::memory_order_relaxed);
    for (std::size_t i = 0; i < ages.size(); ++i) {
      more_[i].store(ages[i] - shortest, std::memory_order_relaxed);
    }
    is_forever_.store(is_forever, std::memory_order_relaxed);
    is_known_.store(is_known, std::memory_order_relaxed);
  }
  // Relaxed is enough: a sample may be judged by the T that held when it came or by the next one.
  [[nodiscard]] shm::Nanoseconds get() const noexcept {
    return age_.load(std::memory_order_relaxed);
  }
  // How much older than get() a sample may be that is for that port. Where another model comes into
  // force between the two loads, together they are no more than T of both.
  [[nodiscard]] shm::Nanoseconds more_of(std::size_t port) const noexcept {
    return more_[port].load(std::memory_order_relaxed);
  }
  // Whether the model in force gives it a T of forever, and the entry no max_age: what was said
  // before still holds.
  [[nodiscard]] bool is_forever() const noexcept {
    return is_forever_.load(std::memory_order_relaxed);
  }
  // Whether T is that of the daemon. It is not yet, or not at all for a user that may not observe.
  [[nodiscard]] bool is_known() const noexcept { return is_known_.load(std::memory_order_relaxed); }

 private:
  shm::Atomic<shm::Nanoseconds> age_{shm::kDefaultTimeout};
  std::array<shm::Atomic<shm::Nanoseconds>, 2> more_{};
  shm::Atomic<bool> is_forever_{false};
  shm::Atomic<bool> is_known_{false};
};

// How old samples of a source may be, by its name: the same as MaxAge says, of any source.
class AgesOfSources {
 public:
  AgesOfSources() = default;
  AgesOfSources(const AgesOfSources&) = delete;
  AgesOfSources& operator=(const AgesOfSources&) = delete;
  virtual ~AgesOfSources() = default;
  [[nodiscard]] virtual shm::Nanoseconds of(std::string_view source) const = 0;
};

// For a queue that the gateway empties itself (iceoryx). One thread.
//
// Invariant: whatever is taken was put in after `since_`. So look at the queue at least every T/4
// (period()), and a sample that is taken at once has three quarters of T left. A queue that is
// never seen empty, because its publisher is fast, holds no more than its capacity: what is taken
// behind as many samples came after the first of them was taken.
class QueueFreshness {
 public:
  explicit QueueFreshness(std::uint32_t capacity) noexcept : capacity_(capacity) {}

  // Nothing waits in the queue: called with a reading of the clock from before the look at it.
  void note_empty(shm::Nanoseconds before_the_look) noexcept {
    since_ = before_the_look;
    taken_ = 0;
  }
  // A sample was taken, at a look before which the clock was read. Before deadline() is asked of
  // it.
  void note_taken(shm::Nanoseconds before_the_look) noexcept {
    if (taken_ > capacity_) {
      since_ = round_;
      taken_ = 0;
    }
    if (taken_ == 0) round_ = before_the_look;
    ++taken_;
  }
  // Of whatever is taken now. Before the first note_empty() nothing is in time.
  [[nodiscard]] shm::Nanoseconds deadline(shm::Nanoseconds max_age) const noexcept {
    return since_ + max_age;
  }
  [[nodiscard]] static constexpr shm::Nanoseconds period(shm::Nanoseconds max_age) noexcept {
    return max_age / 4;
  }

 private:
  const std::uint32_t capacity_;
  // Far enough in the past for any T, and not so far that adding one overflows.
  shm::Nanoseconds since_ = -shm::kMaxTime;
  shm::Nanoseconds round_ = 0;  // before the first of `taken_` samples was taken
  std::uint32_t taken_ = 0;
};

// For a middleware that calls back, of whose queues nothing is known (DDS). A thread of the
// gateway's ticks; a tick that comes late says that the process did not run, and that what is
// delivered now may have waited as long (run_record.hpp). A callback that runs before the first
// tick after such a gap sees the gap itself.
class StallGuard {
 public:
  // One for each entry. Made before the first tick, or while ticks are made; any thread.
  class Watch {
   public:
    explicit Watch(const MaxAge& max_age) noexcept : max_age_(&max_age) {}

   private:
    friend class StallGuard;
    const MaxAge* max_age_;
  };

  // Between two ticks, however short a T is: more often would cost more than it is worth. A T
  // below four times this may call a fresh sample late.
  static constexpr shm::Nanoseconds kShortestPeriod = 1'000'000;

  // Nothing is in time before the first tick. Tick before the middleware can receive anything: what
  // it receives from then on has not waited.
  StallGuard() = default;
  // The watch lives as long as the guard.
  Watch& add(const MaxAge& max_age);

  // Who repeats what was lost while this process did not run may do so long after a stop: for
  // shorter ones nothing is lost, because a socket's buffer holds as much.
  static constexpr shm::Nanoseconds kShortestStop = RunRecord::kLongestDrain;

  // One thread: tick(now), then sleep for what it returns. That is a quarter of the shortest T, so
  // that a sample that comes between two ticks is always in time. `suspended`: for how long the
  // machine has slept so far, which CLOCK_MONOTONIC does not count.
  shm::Nanoseconds tick(shm::Nanoseconds now, shm::Nanoseconds suspended = 0);

  // How often the process, or the machine, has stopped for longer than the shortest T and than
  // kShortestStop. Any thread.
  [[nodiscard]] std::uint64_t stops() const noexcept {
    // Relaxed is enough: whoever asks asks again.
    return stops_.load(std::memory_order_relaxed);
  }

  // Any thread, wait-free: until when a sample that is delivered at `now` may arrive.
  [[nodiscard]] shm::Nanoseconds deadline(const Watch& watch, shm::Nanoseconds now) const noexcept {
    return record_.since(now) + watch.max_age_->get();
  }

 private:
  mutable std::mutex mutex_;  // of watches_
  std::vector<std::unique_ptr<Watch>> watches_;
  RunRecord record_;
  shm::Atomic<std::uint64_t> stops_{0};
  std::optional<shm::Nanoseconds> last_;  // tick, suspended time included; the ticking thread's own
};

}  // namespace arbiter::gateway
