// What components write down of what they do, in memory that outlives them.
//
// Thread safety: each log and each state has one writer at a time, a component or its successor,
// who is started when the predecessor is dead for certain. Others read what is committed.
#pragma once

#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <climits>
#include <cstdint>
#include <cstdio>
#include <new>
#include <stdexcept>
#include <string>

#include "tests/stress/plan.hpp"

namespace arbiter::stress {

// Readings that stand between what comes before and what comes after: the processor must not let
// the operation slip out. It is no fence for stores: one that publish() leaves in the store buffer
// stays there, and is found out.
inline std::int64_t read_clock() noexcept {
  timespec time{};
#if defined(__x86_64__)
  __builtin_ia32_lfence();
#endif
  clock_gettime(CLOCK_MONOTONIC, &time);
#if defined(__x86_64__)
  __builtin_ia32_lfence();
#endif
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

enum class Act : std::uint8_t { kSample, kSignal, kDeactivate };

// One call of publish(), signal() or deactivate().
struct Arrival {
  std::int64_t begin;
  std::atomic<std::int64_t> end;  // 0: it did not return
  std::uint64_t number;           // of the sample
  std::uint32_t incarnation;
  Act act;
  std::uint8_t delivered;
  std::uint8_t discarded;
  std::uint8_t refused;
};

// One take() that gave a sample.
struct Taking {
  std::int64_t begin;
  std::int64_t end;
  std::int64_t stamp;
  std::uint64_t number;
  std::uint32_t source;
  std::uint32_t incarnation;  // of the receiver
};

// An event of a tap.
struct Seen {
  enum What : std::uint8_t { kState, kArrival, kClosed };

  std::int64_t time;
  std::uint64_t number;  // as the sample itself says; 0: there is none, or it could not be read
  std::uint64_t lost;
  std::uint32_t publisher;    // the incarnation, likewise
  std::uint32_t incarnation;  // of the tap's component
  What what;
  Act act;           // of an arrival
  bool knows_fates;  // else the list of destinations has changed too often since
  std::uint8_t accepted;
  std::uint8_t discarded;
  std::uint8_t refused;
};

template <class Record>
struct Log {
  static constexpr std::uint64_t kCapacity = std::uint64_t{1} << 18;
  static constexpr std::uint64_t kEnough = kCapacity / 8 * 7;  // for a round

  alignas(64) std::atomic<std::uint64_t> count;
  std::uint64_t samples;  // numbers given out
  Record records[kCapacity];

  [[nodiscard]] bool is_full() const noexcept {
    return count.load(std::memory_order_relaxed) >= kCapacity - 1;
  }
  [[nodiscard]] Record& next() noexcept { return records[count.load(std::memory_order_relaxed)]; }
  void commit() noexcept {
    count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }
  [[nodiscard]] std::uint64_t size() const noexcept {
    return count.load(std::memory_order_acquire);
  }
};

// Times between one completed operation and the next: by powers of two.
struct Pauses {
  static constexpr std::uint32_t kBuckets = 40;

  std::atomic<std::uint64_t> longest;
  std::atomic<std::uint64_t> buckets[kBuckets];  // [i]: below 2^i ns

  void add(std::int64_t pause) noexcept {
    const auto length = static_cast<std::uint64_t>(pause < 1 ? 1 : pause);
    const auto bucket = static_cast<std::uint32_t>(64 - __builtin_clzll(length));
    auto& in = buckets[bucket < kBuckets ? bucket : kBuckets - 1];
    in.store(in.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    if (length > longest.load(std::memory_order_relaxed)) {
      longest.store(length, std::memory_order_relaxed);
    }
  }
};

struct alignas(64) ComponentState {
  std::atomic<std::uint32_t> incarnation;  // whose ports are open
  std::atomic<std::int64_t> opened_at;
  std::atomic<std::uint64_t> steps;     // arrivals and takes, empty ones too
  std::atomic<std::uint64_t> done;      // with the phase of this number
  std::atomic<std::int64_t> last_step;  // when
  Pauses pauses;
  // Of this incarnation, by its own count.
  std::atomic<std::uint64_t> published;
  std::atomic<std::uint64_t> signals;
  std::atomic<std::uint64_t> delivered;
  std::atomic<std::uint64_t> discarded;
  std::atomic<std::uint64_t> refused;
  std::atomic<std::uint64_t> taken;
};

// How a round begins, once all ports are open, and ends: nobody publishes any more, then relays
// pass on what they have, then all that waits is taken, then ports close.
enum Phase : std::uint32_t {
  kOpening,
  kRunning,
  kPublishersStop,
  kRelaysStop,
  kReceiversStop,
  kEnd
};

struct Records {
  std::atomic<std::uint32_t> phase;
  std::atomic<std::uint64_t> failures;
  ComponentState components[kMaxComponents];
  Log<Arrival> arrivals[kMaxSources];
  Log<Taking> takings[kMaxPorts];
  Log<Seen> seen[kMaxTaps];

  // Once for all rounds.
  static Records& make() {
    void* const memory =
        mmap(nullptr, sizeof(Records), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::runtime_error("no memory for the records");
    return *static_cast<Records*>(memory);  // zero is what they begin as
  }
  // Wakes who waits for it. The store comes before the wake-up, which the kernel orders against the
  // look that await_phase_after() has it take.
  void begin(Phase next) noexcept {
    phase.store(next, std::memory_order_release);
    syscall(SYS_futex, &phase, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
  }
  // In any process. Acquire: pairs with the release in begin().
  void await_phase_after(Phase last) noexcept {
    std::uint32_t now = phase.load(std::memory_order_acquire);
    while (now <= last) {
      syscall(SYS_futex, &phase, FUTEX_WAIT, now, nullptr, nullptr, 0);
      now = phase.load(std::memory_order_acquire);
    }
  }
  void reset() noexcept {
    phase.store(kOpening);
    for (auto& component : components) new (&component) ComponentState{};
    for (auto& log : arrivals) log.count.store(0), log.samples = 0;
    for (auto& log : takings) log.count.store(0), log.samples = 0;
    for (auto& log : seen) log.count.store(0), log.samples = 0;
  }
  void fail(const std::string& what) noexcept {
    // The first few tell enough.
    if (failures.fetch_add(1) < 20) std::fprintf(stderr, "FAILED: %s\n", what.c_str());
  }
  [[nodiscard]] bool has_failed() const noexcept { return failures.load() != 0; }
};

// By the one writer.
template <class Value>
void add(std::atomic<Value>& counter, Value by = 1) noexcept {
  counter.store(counter.load(std::memory_order_relaxed) + by, std::memory_order_relaxed);
}

}  // namespace arbiter::stress
