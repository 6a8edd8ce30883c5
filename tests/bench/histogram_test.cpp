// The histogram against the sorted values themselves.
#include "bench/harness/histogram.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace arbiter::bench {
namespace {

constexpr double kPrecision = 1.0 / 128;

// From below a nanosecond to seconds.
std::vector<double> durations(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> exponent(-2, 9.5);
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(std::pow(10.0, exponent(random)));
  return values;
}

Histogram of(const std::vector<double>& values) {
  Histogram histogram;
  for (const double value : values) histogram.add(value);
  return histogram;
}

TEST(Histogram, QuantilesAreThoseOfTheSortedValues) {
  for (const int count : {1, 2, 3, 10, 1000, 20'000}) {
    auto values = durations(count, 7);
    const Histogram histogram = of(values);
    std::sort(values.begin(), values.end());
    for (const double q : {0.001, 0.25, 0.5, 0.9, 0.99, 0.999, 0.99999, 1.0}) {
      const auto rank = static_cast<std::size_t>(std::max(1.0, std::ceil(q * count)));
      const double exact = values[rank - 1];
      // To a bucket, or to the unit in which small ones are kept.
      EXPECT_NEAR(histogram.quantile(q), exact, exact * kPrecision + 1.0 / 1024)
          << "q " << q << " of " << count;
    }
  }
}

TEST(Histogram, KnowsTheLeastTheMostAndTheMean) {
  const Histogram histogram = of({3, 1, 8});
  EXPECT_EQ(histogram.count(), 3u);
  EXPECT_EQ(histogram.min(), 1);
  EXPECT_EQ(histogram.max(), 8);
  EXPECT_EQ(histogram.mean(), 4);
}

TEST(Histogram, TheMaximumIsExactHoweverRareAndLarge) {
  Histogram histogram;
  histogram.add(100, 1'000'000);
  histogram.add(123'456'789);
  EXPECT_EQ(histogram.max(), 123'456'789);
  EXPECT_EQ(histogram.quantile(1), 123'456'789);
  EXPECT_NEAR(histogram.quantile(0.999'999), 100, 100 * kPrecision);
}

TEST(Histogram, WithoutAValueAllIsZero) {
  const Histogram histogram;
  EXPECT_EQ(histogram.count(), 0u);
  EXPECT_EQ(histogram.quantile(0.5), 0);
  EXPECT_EQ(histogram.min(), 0);
  EXPECT_EQ(histogram.max(), 0);
  EXPECT_EQ(histogram.mean(), 0);
  EXPECT_TRUE(histogram.curve().empty());
}

TEST(Histogram, ATimeThatRanBackwardsCountsAsNone) {
  const Histogram histogram = of({-5});
  EXPECT_EQ(histogram.count(), 1u);
  EXPECT_EQ(histogram.max(), 0);
}

TEST(Histogram, AsWordsItIsTheSame) {
  for (const int count : {0, 1, 5000}) {
    const Histogram sent = of(durations(count, 3));
    const Histogram got = Histogram::of(sent.words());
    EXPECT_EQ(got.words(), sent.words());
    EXPECT_EQ(got.count(), sent.count());
    EXPECT_EQ(got.mean(), sent.mean());
    EXPECT_EQ(got.curve(), sent.curve());
  }
}

TEST(Histogram, TwoMergedAreAsOneOfAll) {
  const auto low = durations(1000, 1);
  const auto high = durations(3000, 2);
  auto all = low;
  all.insert(all.end(), high.begin(), high.end());
  for (const auto& [first, second] : {std::pair(low, high), std::pair(high, low)}) {
    Histogram merged = of(first);
    merged.add(of(second));
    const Histogram expected = of(all);
    EXPECT_EQ(merged.count(), expected.count());
    EXPECT_EQ(merged.min(), expected.min());
    EXPECT_EQ(merged.max(), expected.max());
    EXPECT_EQ(merged.curve(), expected.curve());
    EXPECT_NEAR(merged.mean(), expected.mean(), expected.mean() * 1e-9);
  }
}

TEST(Histogram, MergedWithAnEmptyOneItStaysAsItWas) {
  Histogram histogram = of({2, 4});
  histogram.add(Histogram());
  EXPECT_EQ(histogram.words(), of({2, 4}).words());
}

TEST(Histogram, TheCurveRisesFromTheLeastToTheMost) {
  const Histogram histogram = of(durations(10'000, 5));
  const auto curve = histogram.curve();
  ASSERT_GT(curve.size(), 40u) << "some to each doubling";
  EXPECT_EQ(curve.front(), std::pair(0.0, histogram.min()));
  EXPECT_EQ(curve.back(), std::pair(1.0, histogram.max()));
  for (std::size_t i = 1; i < curve.size(); ++i) {
    EXPECT_GT(curve[i].first, curve[i - 1].first);
    EXPECT_GE(curve[i].second, curve[i - 1].second);
  }
}

}  // namespace
}  // namespace arbiter::bench
