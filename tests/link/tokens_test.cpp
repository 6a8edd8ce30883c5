// Rule 4 of docs/hosts.md, never late: how old a sample can be, told by tokens, without comparing
// the clocks of hosts. A token every T/8, from 1 ms to 250 ms apart; with a round trip of up to T/4
// no sample younger than T/2 is late, and none older than T arrives. The tests say what time it is.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <random>

#include "link/core/event_header.hpp"
#include "link/core/held_tokens.hpp"
#include "link/core/sent_tokens.hpp"
#include "link/core/token_times.hpp"

namespace arbiter::link {
namespace {

using shm::Nanoseconds;

constexpr Nanoseconds kMs = 1'000'000;
constexpr std::uint64_t kWriter = 5;

TEST(TokenTimes, KnowsTheLastOnesExactly) {
  TokenTimes times;
  for (std::uint64_t number = 1; number <= 1000; ++number) {
    times.note(number, static_cast<Nanoseconds>(number) * kMs);
  }
  for (std::uint64_t number = 1000; number > 1000 - 60; --number) {
    EXPECT_EQ(times.time_of(number), static_cast<Nanoseconds>(number) * kMs);
    EXPECT_EQ(times.newest_by(static_cast<Nanoseconds>(number) * kMs + 1), number);
  }
  EXPECT_EQ(times.time_of(1001), std::nullopt);
  EXPECT_EQ(times.time_of(0), std::nullopt);
  EXPECT_EQ(times.newest_by(0), 0U);
}

// A source may be active for hours and another one on the same host for milliseconds.
TEST(TokenTimes, KnowsEarlierOnesWithinAnEighthOfTheirAge) {
  TokenTimes times;
  const std::uint64_t last = 3'000'000;
  for (std::uint64_t number = 1; number <= last; ++number) {
    times.note(number, static_cast<Nanoseconds>(number));
  }
  std::mt19937_64 random(1);
  for (int i = 0; i < 20'000; ++i) {
    const std::uint64_t number = 1 + random() % last;
    const auto age = static_cast<Nanoseconds>(last - number);
    if (const auto time = times.time_of(number)) {
      EXPECT_LE(*time, static_cast<Nanoseconds>(number));
      EXPECT_GE(*time, static_cast<Nanoseconds>(number) - age / 8 - 1) << number;
    } else {
      EXPECT_LT(number, last / 8) << "only the first ones are known no more";
    }
    const std::uint64_t newest = times.newest_by(static_cast<Nanoseconds>(number));
    EXPECT_LE(newest, number);
    if (number > last / 8) {
      EXPECT_GE(newest + static_cast<std::uint64_t>(age) / 8 + 1, number);
    }
  }
}

TEST(TokenTimes, ANumberThatIsNotLargerChangesNothing) {
  TokenTimes times;
  times.note(5, 50);
  times.note(5, 60);
  times.note(4, 70);
  EXPECT_EQ(times.last(), 5U);
  EXPECT_EQ(times.time_of(5), 50);
  EXPECT_EQ(times.newest_by(100), 5U);
}

TEST(TokenTimes, TokensThatWereLostLeaveThoseBefore) {
  TokenTimes times;
  for (const std::uint64_t number : {1U, 2U, 9U, 100U, 101U}) {
    times.note(number, static_cast<Nanoseconds>(number));
  }
  EXPECT_EQ(times.newest_by(99), 9U);
  EXPECT_EQ(times.newest_by(8), 2U);
  EXPECT_EQ(times.newest_by(1'000), 101U);
}

TEST(SentTokens, ASampleIsNoOlderThanTheTokenThatItNames) {
  SentTokens sent;
  const std::uint64_t token = sent.next(1000 * kMs);
  EXPECT_EQ(sent.time_left(token, 500 * kMs, 1100 * kMs), 400 * kMs);
  EXPECT_EQ(sent.time_left(token, 500 * kMs, 1500 * kMs), 0);
  EXPECT_LT(sent.time_left(token, 500 * kMs, 1500 * kMs + 1), 0);
}

TEST(SentTokens, AreSentEachEighthOfTWithinBounds) {
  EXPECT_EQ(token_period(500 * kMs), 500 * kMs / 8);
  EXPECT_EQ(token_period(8 * kMs), kMs);
  EXPECT_EQ(token_period(kMs), kMs) << "so with a T below 8 ms fresh samples may be late";
  EXPECT_EQ(token_period(2'000 * kMs), 250 * kMs);
  EXPECT_EQ(token_period(100'000 * kMs), 250 * kMs);
}

TEST(SentTokens, ATokenThatWasNeverSentIsNoEvidence) {
  SentTokens sent;
  EXPECT_LT(sent.time_left(1, 500 * kMs, 0), 0) << "an earlier life's, or one made up";
  const std::uint64_t token = sent.next(0);
  EXPECT_LT(sent.time_left(token + 1, 500 * kMs, 1), 0);
  EXPECT_LT(sent.time_left(0, 500 * kMs, 1), 0) << "none was held";
}

TEST(HeldTokens, ASampleThatWaitedNamesNoTokenThatCameAfterIt) {
  HeldTokens held;
  ASSERT_TRUE(held.note(7, 1, kWriter, 10));
  ASSERT_TRUE(held.note(7, 2, kWriter, 20));
  std::vector<NamedToken> named;
  held.name(19, named);
  EXPECT_EQ(named, (std::vector<NamedToken>{{7, 1}}));
  held.name(20, named);
  EXPECT_EQ(named, (std::vector<NamedToken>{{7, 2}}));
  held.name(9, named);
  EXPECT_TRUE(named.empty());
}

// Each restart of a link is another importer.
TEST(HeldTokens, AnImporterThatIsSilentForLongIsNamedNoMore) {
  HeldTokens held;
  for (Incarnation life = 1; life <= 5; ++life) ASSERT_TRUE(held.note(life, 1, life, 0));
  ASSERT_TRUE(held.note(5, 2, 5, HeldTokens::kForgotten));
  std::vector<NamedToken> named;
  held.name(HeldTokens::kForgotten, named);
  EXPECT_EQ(named.size(), 5u);
  const shm::Nanoseconds later = HeldTokens::kForgotten + HeldTokens::kSilence;
  ASSERT_TRUE(held.note(5, 3, 5, later));
  held.name(later, named);
  EXPECT_EQ(named, (std::vector<NamedToken>{{5, 3}}));
}

// With a number that the importer has not reached, a stranger would have samples named that are
// taken for young later, or all of them for late.
TEST(HeldTokens, NobodyElseSpeaksInAnImportersName) {
  HeldTokens held;
  ASSERT_TRUE(held.note(7, 1, kWriter, 0));
  EXPECT_FALSE(held.note(7, 1000, kWriter + 1, 1));
  EXPECT_TRUE(held.note(7, 2, kWriter, 2));
  std::vector<NamedToken> named;
  held.name(2, named);
  EXPECT_EQ(named, (std::vector<NamedToken>{{7, 2}}));
}

TEST(HeldTokens, AnImporterThatWasLostMayComeBackByAnotherWriter) {
  HeldTokens held;
  ASSERT_TRUE(held.note(7, 1, kWriter, 0));
  EXPECT_TRUE(held.note(7, 2, kWriter + 1, HeldTokens::kOtherWriter));
  EXPECT_FALSE(held.note(7, 3, kWriter, HeldTokens::kOtherWriter + 1));
}

// A stranger who names the last of all numbers in an importer's name would have all samples taken
// for late there, for as long as the exporter runs.
TEST(HeldTokens, WhoSpokeInAnImportersNameLeavesNothingBehind) {
  HeldTokens held;
  ASSERT_TRUE(held.note(7, ~std::uint64_t{0}, kWriter + 1, 0));
  EXPECT_TRUE(held.note(7, 5, kWriter, HeldTokens::kOtherWriter));
  std::vector<NamedToken> named;
  held.name(HeldTokens::kOtherWriter, named);
  EXPECT_EQ(named, (std::vector<NamedToken>{{7, 5}}));
}

// What waits in the exporter while an importer is lost names the tokens from before.
TEST(HeldTokens, AnImporterThatComesBackIsNamedByItsEarlierTokens) {
  HeldTokens held;
  ASSERT_TRUE(held.note(7, 1, kWriter, 0));
  ASSERT_TRUE(held.note(7, 2, kWriter + 1, HeldTokens::kOtherWriter));
  std::vector<NamedToken> named;
  held.name(HeldTokens::kOtherWriter - 1, named);
  EXPECT_EQ(named, (std::vector<NamedToken>{{7, 1}}));
}

TEST(HeldTokens, StrangersCannotTakeThePlacesOfThoseWhoAreThere) {
  HeldTokens held;
  for (Incarnation importer = 1; importer <= kMaxImporters; ++importer) {
    ASSERT_TRUE(held.note(importer, 1, importer, 0));
  }
  EXPECT_FALSE(held.note(1000, 1, 1000, 1)) << "all places are taken";
  EXPECT_TRUE(held.note(1, 2, 1, 1));
  // Importer 1 spoke last of all: of the silent ones one gives way.
  EXPECT_TRUE(held.note(1000, 1, 1000, HeldTokens::kSilence));
  std::vector<NamedToken> named;
  held.name(HeldTokens::kSilence, named);
  EXPECT_EQ(named.size(), kMaxImporters);
  EXPECT_NE(std::find(named.begin(), named.end(), NamedToken{1, 2}), named.end());
}

// A link that is started again needs a place beside that of its earlier life.
TEST(HeldTokens, OneWriterHasOnePlaceHoweverManyItNames) {
  HeldTokens held;
  EXPECT_TRUE(held.note(1, 1, kWriter, 0));
  for (Incarnation importer = 2; importer <= 2 * kMaxImporters; ++importer) {
    EXPECT_FALSE(held.note(importer, 1, kWriter, 0));
  }
  EXPECT_TRUE(held.note(1000, 1, kWriter + 1, 0));
  EXPECT_FALSE(held.note(1000, 2, kWriter, HeldTokens::kOtherWriter)) << "though it is silent";
  EXPECT_TRUE(held.note(1, 2, kWriter, HeldTokens::kOtherWriter));
  std::vector<NamedToken> named;
  held.name(HeldTokens::kOtherWriter, named);
  EXPECT_EQ(named, (std::vector<NamedToken>{{1, 2}, {1000, 1}}));
}

// Two hosts and a network between them, which delays and loses. Time of both is one here, for the
// test to know how old samples are; they never compare it.
class Network {
 public:
  Network(std::uint32_t seed, Nanoseconds timeout) : random_(seed), timeout_(timeout) {}

  // Tokens and samples each take that long, up to it.
  Nanoseconds token_way = 0;
  Nanoseconds sample_way = 0;
  unsigned tokens_lost = 0;  // of a hundred

  struct Sample {
    Nanoseconds published;
    Nanoseconds arrives;
    std::uint64_t token;
  };
  // A sample that is published at some time of the next stretch, after tokens have gone on.
  Sample next() {
    const Nanoseconds published = now_ + below(timeout_);
    const Nanoseconds arrives = published + below(sample_way);
    run_until(arrives);
    std::vector<NamedToken> named;
    held_.name(published, named);
    return {published, arrives, named.empty() ? 0 : named.front().number};
  }
  [[nodiscard]] Nanoseconds time_left(const Sample& sample) const {
    return sent_.time_left(sample.token, timeout_, sample.arrives);
  }

 private:
  struct Underway {
    Nanoseconds arrives;
    std::uint64_t number;
  };
  Nanoseconds below(Nanoseconds bound) {
    return bound == 0 ? 0 : static_cast<Nanoseconds>(random_() % static_cast<std::uint64_t>(bound));
  }
  void run_until(Nanoseconds time) {
    for (; next_token_ <= time; next_token_ += token_period(timeout_)) {
      const std::uint64_t number = sent_.next(next_token_);
      if (random_() % 100 < tokens_lost) continue;
      underway_.push_back({next_token_ + below(token_way), number});
    }
    std::sort(underway_.begin(), underway_.end(),
              [](const Underway& a, const Underway& b) { return a.arrives < b.arrives; });
    while (!underway_.empty() && underway_.front().arrives <= time) {
      held_.note(1, underway_.front().number, kWriter, underway_.front().arrives);
      underway_.pop_front();
    }
    now_ = std::max(now_, time);
  }

  std::mt19937_64 random_;
  const Nanoseconds timeout_;
  SentTokens sent_;
  HeldTokens held_;
  std::deque<Underway> underway_;
  Nanoseconds next_token_ = 0;
  Nanoseconds now_ = 0;
};

TEST(Age, WithARoundTripOfAQuarterOfTNoSampleYoungerThanHalfOfTIsLate) {
  for (const Nanoseconds timeout : {8 * kMs, 500 * kMs, 10'000 * kMs}) {
    for (std::uint32_t seed = 1; seed <= 20; ++seed) {
      Network network(seed, timeout);
      // The round trip's both ways, shared out at random; and samples that waited beside it.
      network.token_way = timeout / 4 * (seed % 5) / 4;
      network.sample_way = 2 * timeout;
      for (int i = 0; i < 3; ++i) static_cast<void>(network.next());  // the first tokens come
      for (int i = 0; i < 500; ++i) {
        const Network::Sample sample = network.next();
        if (sample.arrives - sample.published < timeout / 2) {
          EXPECT_GE(network.time_left(sample), 0) << "seed " << seed << ", T " << timeout;
        }
      }
    }
  }
}

TEST(Age, WhateverTheNetworkDoesNoSampleOlderThanTArrives) {
  constexpr Nanoseconds kTimeout = 500 * kMs;
  std::uint64_t late = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    Network network(seed, kTimeout);
    network.token_way = seed * kTimeout / 4;
    network.sample_way = 4 * kTimeout;
    network.tokens_lost = seed * 4;
    for (int i = 0; i < 1000; ++i) {
      const Network::Sample sample = network.next();
      const Nanoseconds age = sample.arrives - sample.published;
      const Nanoseconds left = network.time_left(sample);
      EXPECT_LE(left, std::max<Nanoseconds>(kTimeout - age, -1)) << "seed " << seed;
      if (left < 0) ++late;
    }
  }
  EXPECT_GT(late, 0U);
}

}  // namespace
}  // namespace arbiter::link
