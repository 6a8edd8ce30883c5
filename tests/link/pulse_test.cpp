// Rules 3 and 6 of docs/hosts.md, by injected time: how far away a host is, and whether it hears
// this one (2 s).
#include "link/core/pulse.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <set>

#include "tests/link/messages_and_times.hpp"

namespace arbiter::test {
namespace {

using namespace link;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Optional;

// Their clocks have nothing to do with each other.
TEST(RoundTrip, IsMeasuredWithoutComparingClocks) {
  RoundTrips head(1);
  RoundTrips base(2);
  const Participant of_head = participant(1);
  const Participant of_base = participant(2);
  base.note(head.next(1000 * kS), of_head, 5 * kS);            // 2 ms on the way, let us say
  head.note(base.next(6 * kS), of_base, 1001 * kS + 5 * kMs);  // it lay there for a second
  EXPECT_EQ(head.of(of_base), 5 * kMs);
  EXPECT_EQ(base.of(of_head), std::nullopt);
  base.note(head.next(1002 * kS), of_head, 7 * kS + 3 * kMs);
  EXPECT_EQ(base.of(of_head), kS + 3 * kMs - (1002 * kS - 1001 * kS - 5 * kMs));
}

TEST(RoundTrip, IsNotTakenFromEchoesThatCannotBe) {
  RoundTrips me(1);
  const Participant other = participant(2);
  static_cast<void>(me.next(100 * kS));
  me.note({2, 1, {{1, 1, static_cast<std::uint64_t>(2 * kS)}}}, other, 101 * kS);  // lay for longer
  EXPECT_EQ(me.of(other), std::nullopt);
  me.note({2, 2, {{1, 9, 0}}}, other, 101 * kS);  // never sent
  me.note({2, 3, {{1, 0, 0}}}, other, 101 * kS);
  me.note({2, 4, {{3, 1, 0}}}, other, 101 * kS);  // another's
  EXPECT_EQ(me.of(other), std::nullopt);
  me.note({1, 5, {{1, 1, 0}}}, other, 101 * kS);  // pretends to be me
  EXPECT_EQ(me.of(other), std::nullopt);
  me.note({2, 5, {{1, 1, 0}}}, other, 101 * kS);
  EXPECT_EQ(me.of(other), kS);
  me.note({2, 4, {{1, 1, 5}}}, other, 102 * kS);  // overtaken
  EXPECT_EQ(me.of(other), kS);
  for (int i = 0; i < 20; ++i) static_cast<void>(me.next(103 * kS));
  me.note({2, 6, {{1, 1, 0}}}, other, 104 * kS);  // too long ago to be known
  EXPECT_EQ(me.of(other), kS);
}

TEST(RoundTrip, IsNotSpoiltByWhoPulsesInTheNameOfAnother) {
  RoundTrips me(1);
  const Participant head = participant(2);
  const Participant forger = participant(3);
  static_cast<void>(me.next(100 * kS));
  me.note({2, ~std::uint64_t{0}, {}}, forger, 100 * kS);
  me.note({2, 1, {{1, 1, 0}}}, head, 101 * kS);
  EXPECT_EQ(me.of(head), kS);
  me.note({7, 2, {{1, 1, 0}}}, head, 102 * kS);  // it was another one before
  EXPECT_EQ(me.of(head), kS);
}

static_assert(RoundTrips::kUnechoed * RoundTrips::kPulsePeriod == 2 * kS, "rules 3 and 6 say so");

// Two links whose pulses are sent by turns, and come where they are not lost.
class Pulsing : public testing::Test {
 protected:
  void pulse(bool is_lost_there = false, bool is_lost_here = false) {
    now_ += RoundTrips::kPulsePeriod / 2;
    const Pulse ours = me_.next(now_);
    if (!is_lost_there) other_.note(ours, participant(1), now_);
    now_ += RoundTrips::kPulsePeriod / 2;
    const Pulse theirs = other_.next(now_);
    if (!is_lost_here) me_.note(theirs, participant(2), now_);
  }

  RoundTrips me_{1};
  RoundTrips other_{2};
  shm::Nanoseconds now_ = kS;
};

TEST_F(Pulsing, OneThatEchoesHearsUsThoughPulsesAreLost) {
  for (int i = 0; i < 100; ++i) {
    pulse(i % 8 < 5, i % 8 == 6);  // not two or more of eight are lost
    EXPECT_THAT(me_.deaf(), IsEmpty()) << i;
  }
}

TEST_F(Pulsing, OneThatHearsNoneOfOursForTwoSecondsIsDeafAlthoughWeHearIt) {
  pulse();
  for (std::uint64_t i = 1; i < RoundTrips::kUnechoed; ++i) {
    pulse(true);
    EXPECT_THAT(me_.deaf(), IsEmpty());
  }
  pulse(true);
  EXPECT_THAT(me_.deaf(), ElementsAre(participant(2)));
  for (int i = 0; i < 100; ++i) pulse(true);
  EXPECT_THAT(me_.deaf(), ElementsAre(participant(2)));
  pulse();
  EXPECT_THAT(me_.deaf(), IsEmpty());
}

// Once it has lost us it sends no pulses, though it still announces itself.
TEST_F(Pulsing, OneThatIsThereAndDoesNotPulseAnyMoreStaysDeaf) {
  pulse();
  me_.keep({participant(2)});
  for (int i = 0; i < 100; ++i) pulse(true, true);
  EXPECT_THAT(me_.deaf(), ElementsAre(participant(2)));
  me_.keep({});
  EXPECT_THAT(me_.deaf(), IsEmpty()) << "it is gone, and comes back as another";
}

TEST_F(Pulsing, OneThatHasJustComeHasTwoSecondsToHearUs) {
  for (int i = 0; i < 100; ++i) pulse(true, true);
  EXPECT_THAT(me_.deaf(), IsEmpty()) << "nothing is known of it";
  for (std::uint64_t i = 0; i < RoundTrips::kUnechoed; ++i) {
    EXPECT_THAT(me_.deaf(), IsEmpty());
    pulse(true);
  }
  pulse(true);
  EXPECT_THAT(me_.deaf(), ElementsAre(participant(2)));
}

// It has sent nothing that could be echoed.
TEST_F(Pulsing, ALinkThatWasHeldUpTakesNobodyForDeaf) {
  pulse();
  now_ += 100 * kS;
  EXPECT_THAT(me_.deaf(), IsEmpty());
  pulse();
  EXPECT_THAT(me_.deaf(), IsEmpty());
}

TEST(RoundTrip, GivesOneWhoTakesManyNamesOnePlace) {
  RoundTrips me(1);
  for (Incarnation name = 2; name < 1000; ++name) me.note({name, 1, {}}, participant(2), kS);
  EXPECT_EQ(me.next(2 * kS).echoes.size(), 1U);
}

TEST(RoundTrip, KnowsABoundedNumberOfOthersAndForgetsThoseThatAreSilent) {
  RoundTrips me(1);
  for (std::uint16_t other = 2; other < 1000; ++other) {
    const Participant from{static_cast<std::uint8_t>(other >> 8), static_cast<std::uint8_t>(other)};
    me.note({other, 1, {}}, from, kS);
  }
  EXPECT_EQ(me.next(2 * kS).echoes.size(), kMaxEchoes);
  const ByteString largest = write_pulse(me.next(2 * kS));
  EXPECT_TRUE(read_pulse(as_bytes(largest)));
  EXPECT_FALSE(read_pulse(as_bytes(write_pulse({0, 1, {}})))) << "nobody's";
  EXPECT_FALSE(read_pulse(as_bytes(write_pulse({1, 0, {}})))) << "none";
  EXPECT_THAT(me.next(kS + RoundTrips::kSilence).echoes, IsEmpty());
}

// That a host has said something else, or is believed to live, does not count.
TEST_F(Pulsing, OneThatDoesNotPulseForTenSecondsInWhichThisLinkRanDoesNotPulseAnyMore) {
  EXPECT_THAT(me_.pulsing(), Optional(IsEmpty()));
  pulse();
  me_.keep({participant(2)});
  now_ += 100 * kS;  // held up
  EXPECT_THAT(me_.pulsing(), Optional(ElementsAre(participant(2))));
  for (std::uint64_t i = 1; i < RoundTrips::kUnheard; ++i) pulse(false, true);
  EXPECT_THAT(me_.pulsing(), Optional(ElementsAre(participant(2))));
  pulse(false, true);
  EXPECT_THAT(me_.pulsing(), Optional(IsEmpty()));
  pulse();
  EXPECT_THAT(me_.pulsing(), Optional(ElementsAre(participant(2))));
}

// Though the transport believes that they are there.
TEST(RoundTrip, GivesThePlacesOfThoseThatPulseNoMoreToOthers) {
  RoundTrips me(1);
  std::set<Participant> there;
  for (std::uint16_t other = 0; other < kMaxEchoes; ++other) {
    const Participant from{1, static_cast<std::uint8_t>(other)};
    me.note({2U + other, 1, {}}, from, kS);
    there.insert(from);
  }
  me.keep(there);
  EXPECT_EQ(me.pulsing(), std::nullopt) << "who finds no place may pulse, too";
  for (std::uint64_t i = 1; i < RoundTrips::kUnheard; ++i) static_cast<void>(me.next(2 * kS));
  me.note({1000, 1, {}}, participant(2), 2 * kS);
  EXPECT_EQ(me.pulsing(), std::nullopt);
  static_cast<void>(me.next(2 * kS));
  me.note({1000, 1, {}}, participant(2), 2 * kS);
  EXPECT_THAT(me.pulsing(), Optional(ElementsAre(participant(2))));
}

}  // namespace
}  // namespace arbiter::test
