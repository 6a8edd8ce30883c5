#include "bench/harness/rounds.hpp"

#include <gmock/gmock.h>

#include <stdexcept>

#include "bench/harness/interruption.hpp"

namespace arbiter::bench {
namespace {

using testing::ElementsAre;

Histogram one(double ns) {
  Histogram histogram;
  histogram.add(ns);
  return histogram;
}

TEST(Rounds, AreInterleavedAndEachBeginsWithAnother) {
  std::string order;
  const auto contender = [&](const char* name) {
    return Contender{name, Role::kPeer, [&order, name](double) {
                       order += name;
                       return one(1);
                     }};
  };
  run_rounds({contender("a"), contender("b"), contender("c")}, {3, 0.1});
  EXPECT_EQ(order,
            "abc"  // the warm-up
            "bca"
            "cab"
            "abc");
}

TEST(Rounds, TheWarmUpIsShorterAndDoesNotCount) {
  std::vector<double> times;
  const auto results = run_rounds({{"a", Role::kOurs,
                                    [&](double seconds) {
                                      times.push_back(seconds);
                                      return one(static_cast<double>(times.size()));
                                    }}},
                                  {2, 0.5});
  EXPECT_THAT(times, ElementsAre(0.25, 0.5, 0.5));
  ASSERT_EQ(results.size(), 1u);
  EXPECT_EQ(results[0].ns.count(), 2u);
  EXPECT_EQ(results[0].ns.min(), 2);
  EXPECT_EQ(results[0].ns.max(), 3);
  EXPECT_EQ(results[0].note, "");
}

TEST(Rounds, CanBeWatched) {
  std::string seen;
  watch_rounds([&](const Round& round) {
    seen += round.system + std::to_string(round.number) + "/" + std::to_string(round.of) + " ";
  });
  const auto measure = [](double) { return one(1); };
  run_rounds({{"a", Role::kOurs, measure}, {"b", Role::kPeer, measure}}, {1, 0.1});
  watch_rounds({});
  run_rounds({{"c", Role::kOurs, measure}}, {1, 0.1});
  EXPECT_EQ(seen, "a0/1 b0/1 b1/1 a1/1 ");
}

TEST(Rounds, WhoFailsIsOutAndTheReportSaysWhyWhileOthersGoOn) {
  int failing_rounds = 0;
  const auto results = run_rounds({{"broken", Role::kPeer,
                                    [&](double) -> Histogram {
                                      if (++failing_rounds == 2)
                                        throw std::runtime_error("it hung");
                                      return one(7);
                                    }},
                                   {"sound", Role::kFloor, [](double) { return one(5); }}},
                                  {4, 0.1});
  ASSERT_EQ(results.size(), 2u);
  EXPECT_EQ(failing_rounds, 2) << "it was not asked again";
  EXPECT_EQ(results[0].system, "broken");
  EXPECT_EQ(results[0].role, Role::kPeer);
  EXPECT_EQ(results[0].note, "it hung");
  EXPECT_EQ(results[1].system, "sound");
  EXPECT_EQ(results[1].role, Role::kFloor);
  EXPECT_EQ(results[1].note, "");
  EXPECT_EQ(results[1].ns.count(), 4u);
}

TEST(Rounds, AnInterruptionIsNoFailureOfTheContender) {
  const auto interrupted = [](double) -> Histogram { throw Interrupted(); };
  EXPECT_THROW(run_rounds({{"a", Role::kOurs, interrupted}}, {1, 0.1}), Interrupted);
}

TEST(Rounds, WhatCannotBeHadIsAResultWithAReason) {
  const Result result = absent("iceoryx", Role::kPeer, "is not installed");
  EXPECT_EQ(result.system, "iceoryx");
  EXPECT_EQ(result.role, Role::kPeer);
  EXPECT_EQ(result.note, "is not installed");
  EXPECT_EQ(result.ns.count(), 0u);
  EXPECT_FALSE(result.value);
}

}  // namespace
}  // namespace arbiter::bench
