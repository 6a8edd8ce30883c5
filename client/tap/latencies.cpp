// How long samples waited at the input port that a tap watches, as the port counts it.
#include "client/tap/tap_core.hpp"
#include "shm/latency.hpp"

namespace arbiter::detail {

// Of ports that are open: a port has one at a time.
Latencies TapCore::latencies() {
  accept_view();
  if (view_ == nullptr) return {};
  for (const TapInputLink& link : view_->inputs) {
    if (link.gone) continue;
    const auto& counted = link.input->mapping.as<const shm::InputSegment>()->header.latencies;
    std::vector<Latencies::Bucket> buckets;
    buckets.reserve(shm::kLatencyBuckets);
    for (std::size_t i = 0; i < shm::kLatencyBuckets; ++i) {
      // Relaxed is enough for a counter. One that ran backwards would be a lie.
      const std::uint64_t samples = counted[i].load(std::memory_order_relaxed);
      const std::uint64_t before = link.input->latencies[i];
      buckets.push_back({std::chrono::nanoseconds(shm::latency_bound(i)),
                         samples < before ? 0 : samples - before});
    }
    return Latencies(std::move(buckets));
  }
  return {};
}

}  // namespace arbiter::detail
