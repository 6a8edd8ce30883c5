// The report as JSON, and what is judged of it.
#include "bench/harness/report.hpp"

#include <gmock/gmock.h>

#include "bench/measures/measures.hpp"
#include "bench/peers/systems.hpp"
#include "bench/targets.hpp"

namespace arbiter::bench {
namespace {

using testing::IsEmpty;

Histogram all_at(double ns, std::uint64_t count = 100) {
  Histogram histogram;
  histogram.add(ns, count);
  return histogram;
}

Result of(const std::string& system, Role role, double ns) {
  return {system, role, all_at(ns), {}, {}};
}

// What the target "64 B spinning, p50, to a cache line" reads.
Report delivery(double ours, double cache_line) {
  Report report;
  Measure measure{"delivery", "One-way delivery", ""};
  measure.cases.push_back(
      {"64 B, spinning",
       64,
       {of(kArbiter, Role::kOurs, ours), of(kCacheLine, Role::kFloor, cache_line)}});
  report.measures.push_back(measure);
  return report;
}

const Verdict* find(const std::vector<Verdict>& verdicts, const std::string& name) {
  for (const Verdict& each : verdicts) {
    if (each.name == name) return &each;
  }
  return nullptr;
}

const char* const kToCacheLine = "64 B spinning, p50, to a cache line";

TEST(Judge, ARatioIsOfOursToTheirs) {
  const auto verdicts = judge(delivery(500, 250));
  const Verdict* const verdict = find(verdicts, kToCacheLine);
  ASSERT_NE(verdict, nullptr);
  ASSERT_TRUE(verdict->measured);
  EXPECT_NEAR(*verdict->measured, 2, 0.02);
  EXPECT_TRUE(verdict->is_met());
}

TEST(Judge, ALimitExceededIsMissed) {
  const auto verdicts = judge(delivery(2500, 250));
  const Verdict* const verdict = find(verdicts, kToCacheLine);
  ASSERT_NE(verdict, nullptr);
  EXPECT_FALSE(verdict->is_met());
}

TEST(Judge, WhatCouldNotBeMeasuredIsNotMet) {
  Report report = delivery(500, 250);
  report.measures[0].cases[0].results.pop_back();
  const auto verdicts = judge(report);
  const Verdict* const verdict = find(verdicts, kToCacheLine);
  ASSERT_NE(verdict, nullptr);
  EXPECT_FALSE(verdict->measured);
  EXPECT_FALSE(verdict->is_met());
}

// Times by their percentiles, and the processor time beside them.
TEST(Judge, AGatewayIsComparedWithARelayInEachOfItsCosts) {
  Report report;
  Measure measure{"gateway-dds", "DDS", ""};
  measure.cases.push_back(
      {"64 B, one way",
       64,
       {of(kThroughGateway, Role::kOurs, 1100), of(kThroughRelay, Role::kPeer, 1000),
        of(kStraight, Role::kFloor, 10)}});
  measure.cases.push_back({"64 B, processor time of a sample",
                           64,
                           {{kThroughGateway, Role::kOurs, {}, 130.0, {}},
                            {kThroughRelay, Role::kPeer, {}, 100.0, {}}}});
  report.measures.push_back(measure);
  const auto verdicts = judge(report);
  for (const char* const met :
       {"DDS gateway, 64 B, p50, to a relay", "DDS gateway, 64 B, p99, to a relay"}) {
    const Verdict* const verdict = find(verdicts, met);
    ASSERT_NE(verdict, nullptr);
    EXPECT_TRUE(verdict->is_met());
    EXPECT_EQ(verdict->group, kGateways);
  }
  const Verdict* const processor = find(verdicts, "DDS gateway, 64 B, processor, to a relay");
  ASSERT_NE(processor, nullptr);
  EXPECT_NEAR(processor->measured.value_or(0), 1.3, 0.001);
  EXPECT_FALSE(processor->is_met());
  const Verdict* const other_size = find(verdicts, "DDS gateway, 1 MiB, p50, to a relay");
  ASSERT_NE(other_size, nullptr);
  EXPECT_FALSE(other_size->measured);
}

TEST(Judge, WhatWasNotAskedForIsNotJudged) { EXPECT_THAT(judge(Report{}), IsEmpty()); }

TEST(Report, RatiosAreOfOursToAllOthers) {
  const nlohmann::json json = delivery(600, 200).json();
  const auto& one = json["measures"][0]["cases"][0];
  EXPECT_EQ(one["x"], 64);
  EXPECT_NEAR(one["p50_ratios"][kArbiter][kCacheLine].get<double>(), 3, 0.03);
  EXPECT_EQ(one["results"][0]["role"], "ours");
  EXPECT_EQ(one["results"][1]["role"], "floor");
}

TEST(Report, RareTailsAreSaidOnlyOfManySamples) {
  Report report;
  Measure measure{"m", "M", ""};
  for (const std::uint64_t count : {999u, 1000u, 10'000u, 100'000u, 1'000'000u}) {
    measure.cases.push_back(
        {std::to_string(count), {}, {{"arbiter", Role::kOurs, all_at(5, count), {}, {}}}});
  }
  report.measures.push_back(measure);
  const nlohmann::json json = report.json();
  const auto result = [&](std::size_t i) { return json["measures"][0]["cases"][i]["results"][0]; };
  const std::vector<std::string> tails{"p99", "p99.9", "p99.99", "p99.999"};
  for (std::size_t i = 0; i <= tails.size(); ++i) {
    for (std::size_t tail = 0; tail < tails.size(); ++tail) {
      EXPECT_EQ(result(i).contains(tails[tail]), tail < i) << tails[tail] << " of " << i;
    }
    EXPECT_TRUE(result(i).contains("p50"));
  }
  EXPECT_EQ(result(4)["count"], 1'000'000);
}

TEST(Report, ACaseMayHaveAUnitOfItsOwn) {
  Report report;
  Measure measure{"scale", "Scale", "", "ns"};
  measure.cases.push_back({"memory", {}, {{"arbiterd", Role::kOurs, {}, 10.5, {}}}, "MiB"});
  measure.cases.push_back({"time", {}, {}});
  report.measures.push_back(measure);
  const auto cases = report.json()["measures"][0]["cases"];
  EXPECT_EQ(cases[0]["unit"], "MiB");
  EXPECT_EQ(cases[0]["results"][0]["value"], 10.5);
  EXPECT_FALSE(cases[1].contains("unit"));
}

}  // namespace
}  // namespace arbiter::bench
