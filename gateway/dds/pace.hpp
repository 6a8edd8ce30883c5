// How large a sample may be for the thread that receives samples to send it.
//
// That thread, Cyclone's, reads no datagram meanwhile, of no topic, and an emergency stop may be
// next; if it takes long, the socket's buffer overflows. To hand the sample over to the gateway's
// loop costs the waking of a thread. How long it takes depends on the network: 8 MiB take 65 ms at
// 1 Gbit/s, 1 MiB takes half a millisecond between programs of one machine. So it is measured.
//
// Invariant: what is sent there takes no longer than kLongest, if it goes as fast as the last
// samples that were larger than kAlways. One that was slower counts at once, one that was faster by
// and by; and it says nothing of one more than twice as large, for the socket's buffer may have
// taken it as a whole.
//
// Thread safety: note() by one thread at a time, largest() by any.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>

#include "gateway/dds/payload.hpp"
#include "shm/activity.hpp"

namespace arbiter::gateway::dds {

class Pace {
 public:
  // Fits into the socket's buffer, so that it never waits for the network.
  static constexpr std::size_t kAlways = kEncapsulationBytes + (std::size_t{64} << 10);
  static constexpr shm::Nanoseconds kLongest = 2'000'000;

  // In bytes. Relaxed is enough: a sample may be judged by the measurement before the last.
  [[nodiscard]] std::size_t largest() const noexcept {
    return largest_.load(std::memory_order_relaxed);
  }
  // A sample of so many bytes, more than kAlways, took so long to send.
  void note(std::size_t bytes, shm::Nanoseconds took) noexcept {
    const std::size_t before = largest();
    const double in_time = static_cast<double>(bytes) * static_cast<double>(kLongest) /
                           static_cast<double>(std::max<shm::Nanoseconds>(took, 1));
    const auto now = static_cast<std::size_t>(std::min(in_time, 2.0 * static_cast<double>(bytes)));
    const std::size_t next = now < before ? now : before + (now - before) / 4;
    largest_.store(std::max(next, kAlways), std::memory_order_relaxed);
  }

 private:
  std::atomic<std::size_t> largest_{kAlways};
};

}  // namespace arbiter::gateway::dds
