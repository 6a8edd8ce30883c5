// How long samples waited at an input port, from publish to take: what Tap::latencies() counts.
//
// Units: nanoseconds of CLOCK_MONOTONIC, from a sample's arrival time to the reading that the take
// makes when it returns the sample. Threads: a value. Cost: copies allocate. The paper has nothing
// of it.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace arbiter {

class Latencies {
 public:
  struct Bucket {
    std::chrono::nanoseconds below{};  // and not below the bound of the bucket before
    std::uint64_t samples = 0;
  };

  Latencies() = default;
  explicit Latencies(std::vector<Bucket> buckets) noexcept : buckets_(std::move(buckets)) {}

  // Ascending; four for each doubling of time, so that a bound is at most a quarter more than what
  // it stands for. The last one has all from two minutes on. Empty: nothing is measured.
  [[nodiscard]] const std::vector<Bucket>& buckets() const noexcept { return buckets_; }
  [[nodiscard]] std::uint64_t samples() const noexcept {
    std::uint64_t all = 0;
    for (const Bucket& bucket : buckets_) all += bucket.samples;
    return all;
  }
  // What `share` (0 to 1) of the samples did not reach: percentile(0.99). 0 where there is none.
  [[nodiscard]] std::chrono::nanoseconds percentile(double share) const noexcept {
    const auto all = static_cast<double>(samples());
    double found = 0;
    for (const Bucket& bucket : buckets_) {
      found += static_cast<double>(bucket.samples);
      if (bucket.samples != 0 && found >= share * all) return bucket.below;
    }
    return {};
  }
  // Without those that `before` had already; of a port that was opened again since, all.
  [[nodiscard]] Latencies since(const Latencies& before) const {
    Latencies result = *this;
    if (before.buckets_.size() != buckets_.size()) return result;
    for (std::size_t i = 0; i < buckets_.size(); ++i) {
      if (buckets_[i].samples < before.buckets_[i].samples) return *this;
      result.buckets_[i].samples -= before.buckets_[i].samples;
    }
    return result;
  }

 private:
  std::vector<Bucket> buckets_;
};

}  // namespace arbiter
