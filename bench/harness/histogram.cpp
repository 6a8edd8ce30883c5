#include "bench/harness/histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace arbiter::bench {

void Histogram::add(const Histogram& other) {
  if (counts_.size() < other.counts_.size()) counts_.resize(other.counts_.size());
  for (std::size_t i = 0; i < other.counts_.size(); ++i) counts_[i] += other.counts_[i];
  count_ += other.count_;
  sum_ += other.sum_;
  min_ = std::min(min_, other.min_);
  max_ = std::max(max_, other.max_);
}

double Histogram::middle_of(std::size_t bucket) {
  const std::size_t buckets = std::size_t{1} << kBits;
  if (bucket < 2 * buckets) return (static_cast<double>(bucket) + 0.5) / kUnits;
  const auto shift = static_cast<int>((bucket >> kBits) - 1);
  const auto low = static_cast<double>(bucket - (static_cast<std::size_t>(shift) << kBits));
  return std::ldexp(low + 0.5, shift) / kUnits;
}

double Histogram::quantile(double q) const {
  if (count_ == 0) return 0;
  const auto rank = static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    seen += counts_[i];
    if (seen >= std::max<std::uint64_t>(rank, 1)) return std::clamp(middle_of(i), min(), max());
  }
  return max();
}

std::vector<std::pair<double, double>> Histogram::curve() const {
  std::vector<std::pair<double, double>> points;
  if (count_ == 0) return points;
  points.emplace_back(0, min());
  for (double rest = 1; rest * static_cast<double>(count_) >= 1; rest /= 2) {
    for (int part = 1; part <= 4; ++part) {
      const double share = 1 - rest * (1 - part / 8.0);
      points.emplace_back(share, quantile(share));
    }
  }
  points.emplace_back(1, max());
  return points;
}

std::vector<std::uint64_t> Histogram::words() const {
  std::vector<std::uint64_t> words{count_, min_, max_, std::bit_cast<std::uint64_t>(sum_)};
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    if (counts_[i] == 0) continue;
    words.push_back(i);
    words.push_back(counts_[i]);
  }
  return words;
}

Histogram Histogram::of(const std::vector<std::uint64_t>& words) {
  Histogram result;
  result.count_ = words.at(0);
  result.min_ = words.at(1);
  result.max_ = words.at(2);
  result.sum_ = std::bit_cast<double>(words.at(3));
  for (std::size_t i = 4; i + 1 < words.size(); i += 2) {
    if (result.counts_.size() <= words[i]) result.counts_.resize(words[i] + 1);
    result.counts_[words[i]] = words[i + 1];
  }
  return result;
}

}  // namespace arbiter::bench
