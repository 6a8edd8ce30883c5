// How often each duration was seen: all of them, to the last, in fixed memory.
//
// Log-linear, as HdrHistogram: 128 buckets to each doubling, so that a value is known to 0.8 %.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace arbiter::bench {

// Durations are in nanoseconds; fractions of one are kept, for operations of a few of them.
class Histogram {
 public:
  void add(double nanoseconds, std::uint64_t times = 1) {
    const auto value = static_cast<std::uint64_t>(nanoseconds < 0 ? 0 : nanoseconds * kUnits);
    const std::size_t index = bucket_of(value);
    if (index >= counts_.size()) counts_.resize(index + 1);
    counts_[index] += times;
    count_ += times;
    sum_ += nanoseconds * static_cast<double>(times);
    if (value > max_) max_ = value;
    if (value < min_) min_ = value;
  }
  void add(const Histogram& other);

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] double mean() const { return count_ == 0 ? 0 : sum_ / static_cast<double>(count_); }
  [[nodiscard]] double min() const { return count_ == 0 ? 0 : static_cast<double>(min_) / kUnits; }
  [[nodiscard]] double max() const { return static_cast<double>(max_) / kUnits; }
  // The duration that a share `q` of all did not exceed.
  [[nodiscard]] double quantile(double q) const;
  // {share, duration}, thinned towards the tail so that each doubling of 1 / (1 - share) has some.
  [[nodiscard]] std::vector<std::pair<double, double>> curve() const;

  // As words, to be sent from one process to another.
  [[nodiscard]] std::vector<std::uint64_t> words() const;
  static Histogram of(const std::vector<std::uint64_t>& words);

 private:
  static constexpr double kUnits = 1024;  // to a nanosecond
  static constexpr int kBits = 7;

  static std::size_t bucket_of(std::uint64_t value) {
    if (value < (std::uint64_t{1} << kBits)) return value;
    const int shift = 63 - __builtin_clzll(value) - kBits;
    return (static_cast<std::size_t>(shift) << kBits) + (value >> shift);
  }
  static double middle_of(std::size_t bucket);

  std::vector<std::uint64_t> counts_;
  std::uint64_t count_ = 0;
  std::uint64_t min_ = UINT64_MAX;
  std::uint64_t max_ = 0;
  double sum_ = 0;
};

}  // namespace arbiter::bench
