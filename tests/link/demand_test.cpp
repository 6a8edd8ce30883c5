// Rule 7 of docs/hosts.md, losers stay at home: what an importer wants, and what an exporter keeps.
// What is larger than 1 KiB and has lost for 100 ms; headers that are not believed after T.
#include "link/core/demand.hpp"

#include <gtest/gtest.h>

#include <array>

#include "link/core/kept_sample.hpp"
#include "link/core/stream.hpp"

namespace arbiter::link {
namespace {

using shm::Nanoseconds;

constexpr Nanoseconds kLong = ImportDemand::kLosesFor;
constexpr Nanoseconds kAge = 5 * kLong;

static_assert(kLong == 100'000'000 && kSmallSample == 1024, "rule 7 says so");

TEST(ImportDemand, ALoserStaysAtHomeOnceItHasLostForAWhile) {
  ImportDemand demand(SourceUse::kFinite, 0);
  EXPECT_EQ(demand.demand(), Demand::kSamples) << "nothing is known yet";
  demand.note_arrival(false, 1000);
  demand.note_arrival(false, 1000 + kLong - 1);
  EXPECT_EQ(demand.demand(), Demand::kSamples);
  demand.note_arrival(false, 1000 + kLong);
  EXPECT_EQ(demand.demand(), Demand::kSmallSamples);
  demand.note_arrival(true, 2000 + kLong);
  EXPECT_EQ(demand.demand(), Demand::kSamples) << "at once";
}

TEST(ImportDemand, OneThatWinsNowAndThenIsSentWhole) {
  ImportDemand demand(SourceUse::kFinite, 0);
  for (Nanoseconds now = 0; now < 20 * kLong; now += kLong / 4) {
    demand.note_arrival(now / (kLong / 4) % 4 == 0, now);
    EXPECT_EQ(demand.demand(), Demand::kSamples);
  }
}

TEST(ImportDemand, ForeverIsNeverWithheld) {
  ImportDemand demand(SourceUse::kForever, 0);
  for (Nanoseconds now = 0; now < 20 * kLong; now += kLong / 4) demand.note_arrival(false, now);
  EXPECT_EQ(demand.demand(), Demand::kSamples);
}

TEST(ImportDemand, WhatIsOnlySensedCrossesAsHeadersFromTheBeginning) {
  ImportDemand demand(SourceUse::kSensed, 0);
  EXPECT_EQ(demand.demand(), Demand::kHeaders);
  demand.note_arrival(true, 1);
  EXPECT_EQ(demand.demand(), Demand::kSamples) << "a tap reads its samples";
  demand.note_arrival(false, 2);
  EXPECT_EQ(demand.demand(), Demand::kHeaders);
  demand.set_use(SourceUse::kFinite, 3);
  EXPECT_EQ(demand.demand(), Demand::kSamples) << "another model";
  demand.set_use(SourceUse::kNone, 4);
  EXPECT_EQ(demand.demand(), Demand::kHeaders) << "a component here has it open";
}

TEST(ImportDemand, AnotherModelWithTheSameUseChangesNothing) {
  ImportDemand demand(SourceUse::kFinite, 0);
  demand.note_arrival(false, 0);
  demand.note_arrival(false, kLong);
  demand.set_use(SourceUse::kFinite, kLong + 1);
  EXPECT_EQ(demand.demand(), Demand::kSmallSamples);
}

// Its activity would inhibit all others, and nobody would ever have a sample of it.
TEST(ImportDemand, AnExporterThatGoesOnWithoutSamplesIsTakenForSilent) {
  ImportDemand demand(SourceUse::kFinite, 0);
  EXPECT_TRUE(demand.believes_header(kAge, kAge));
  EXPECT_FALSE(demand.believes_header(kAge, kAge + 1));
  demand.begin_exporter(kAge);
  EXPECT_TRUE(demand.believes_header(kAge, 2 * kAge)) << "another one must hear it first";
  demand.note_arrival(false, kAge);
  demand.note_arrival(false, kAge + kLong);
  EXPECT_TRUE(demand.believes_header(kAge, 100 * kAge)) << "it is as we want it";
  demand.note_arrival(true, 100 * kAge);
  demand.note_arrival(true, 101 * kAge);
  EXPECT_TRUE(demand.believes_header(kAge, 101 * kAge));
  EXPECT_FALSE(demand.believes_header(kAge, 101 * kAge + 1));
}

TEST(Demand, SaysWhichSamplesStayAtHome) {
  EXPECT_FALSE(is_withheld(Demand::kSamples, 1U << 24U));
  EXPECT_FALSE(is_withheld(Demand::kSmallSamples, kSmallSample));
  EXPECT_TRUE(is_withheld(Demand::kSmallSamples, kSmallSample + 1));
  EXPECT_TRUE(is_withheld(Demand::kHeaders, 0));
}

TEST(KeptSample, IsTheNewestAndGoesWithItsMemory) {
  KeptSample kept;
  EXPECT_FALSE(kept.is_there());
  const std::array<std::byte, 3> old{std::byte{1}};
  const std::array<std::byte, 2> young{std::byte{2}, std::byte{3}};
  kept.keep({{1, 1}}, Bytes(old.data(), old.size()));
  kept.keep({{1, 2}}, Bytes(young.data(), young.size()));
  ASSERT_TRUE(kept.is_there());
  ASSERT_EQ(kept.sample().size(), young.size());
  EXPECT_EQ(kept.sample()[1], std::byte{3});
  EXPECT_EQ(kept.tokens(), (std::vector<NamedToken>{{1, 2}}));
  kept.drop();
  EXPECT_FALSE(kept.is_there());
  kept.end();
  EXPECT_EQ(kept.sample().size(), 0U);
}

StreamEvent withheld(std::uint64_t number, std::uint64_t sequence) {
  return {number, sequence, true, false, true};
}

TEST(WithheldStream, ASampleThatIsSentAgainIsNoOtherEvent) {
  Stream stream;
  EXPECT_TRUE(stream.note(1, withheld(4, 4)));
  EXPECT_TRUE(stream.note(1, withheld(5, 5)));
  EXPECT_FALSE(stream.completes(1, 4)) << "it is not the newest";
  EXPECT_FALSE(stream.completes(2, 5)) << "another exporter's";
  EXPECT_TRUE(stream.completes(1, 5));
  EXPECT_FALSE(stream.completes(1, 5)) << "it comes once";
  EXPECT_TRUE(stream.note(1, {6, 6, true, false, false}));
  EXPECT_FALSE(stream.completes(1, 6)) << "it came at once";
  EXPECT_EQ(stream.lost(), 0U);
  EXPECT_EQ(stream.doubled(), 0U);
}

TEST(WithheldStream, OneWhoseHeaderWasLostIsAnEventAsAnyOther) {
  Stream stream;
  EXPECT_TRUE(stream.note(1, withheld(4, 4)));
  EXPECT_FALSE(stream.completes(1, 5));
  EXPECT_TRUE(stream.note(1, {5, 5, true, false, false}));
  EXPECT_EQ(stream.lost(), 0U);
}

TEST(WithheldStream, ASignalLeavesTheSampleWhatItWas) {
  Stream stream;
  EXPECT_TRUE(stream.note(1, withheld(4, 4)));
  EXPECT_TRUE(stream.note(1, {5, 4, false, false, false}));
  EXPECT_TRUE(stream.completes(1, 5)) << "it bears the number of the last event";
}

TEST(WithheldStream, ADeactivationEndsIt) {
  Stream stream;
  EXPECT_TRUE(stream.note(1, withheld(4, 4)));
  EXPECT_TRUE(stream.note(1, {5, 4, false, true, false}));
  EXPECT_FALSE(stream.completes(1, 5));
  EXPECT_TRUE(stream.is_deactivated());
}

}  // namespace
}  // namespace arbiter::link
