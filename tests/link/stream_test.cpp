// Rules 2, 5 and 6 of docs/hosts.md: when a source is imported at all (three things hold); order,
// doubles, losses and the present state; one speaker, which is kept until it is gone.
#include "link/core/stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "link/core/import_choice.hpp"
#include "link/core/speaker.hpp"

namespace arbiter::link {
namespace {

using testing::ElementsAre;

StreamEvent event(std::uint64_t number, bool is_deactivated) {
  return {number, 0, false, is_deactivated};
}

StreamEvent sample(std::uint64_t number, std::uint64_t sequence) {
  return {number, sequence, true, false};
}

TEST(Stream, CountsWhatDoesNotCome) {
  Stream stream;
  EXPECT_TRUE(stream.note(1, event(10, false)));
  EXPECT_EQ(stream.lost(), 0U) << "what was sent before it joined is not missed";
  EXPECT_TRUE(stream.note(1, event(11, false)));
  EXPECT_TRUE(stream.note(1, event(15, false)));
  EXPECT_EQ(stream.lost(), 3U);
  EXPECT_EQ(stream.doubled(), 0U);
}

// While all who read a source are cut off, its exporter does not look at it.
TEST(Stream, CountsSamplesThatItsExporterDidNotNumber) {
  Stream stream;
  EXPECT_TRUE(stream.note(1, sample(1, 500)));
  EXPECT_TRUE(stream.note(1, sample(2, 501)));
  EXPECT_EQ(stream.lost(), 0U);
  EXPECT_TRUE(stream.note(1, {3, 501, false, false})) << "joined again";
  EXPECT_TRUE(stream.note(1, {4, 511, false, false})) << "its publisher tells how far it is";
  EXPECT_TRUE(stream.note(1, sample(5, 512)));
  EXPECT_EQ(stream.lost(), 10U);
  EXPECT_TRUE(stream.note(1, sample(9, 516)));
  EXPECT_EQ(stream.lost(), 13U) << "counted once, not twice";
  EXPECT_TRUE(stream.note(1, sample(10, 1))) << "the publisher's successor";
  EXPECT_EQ(stream.lost(), 13U);
}

TEST(Stream, DoesNotMissWhatCameWithoutItsSample) {
  Stream stream;
  EXPECT_TRUE(stream.note(1, sample(1, 500)));
  EXPECT_TRUE(stream.note(1, {2, 500, false, false})) << "a signal of its publisher";
  EXPECT_TRUE(stream.note(1, sample(3, 501))) << "with it or not";
  EXPECT_TRUE(stream.note(1, sample(14, 512))) << "behind ten that its tap has missed";
  EXPECT_EQ(stream.lost(), 10U);
}

TEST(Stream, CountsNothingBelowZeroWhateverAnExporterSays) {
  constexpr auto kLast = ~std::uint64_t{0};
  Stream stream;
  EXPECT_TRUE(stream.note(1, sample(1, kLast)));
  EXPECT_TRUE(stream.note(1, sample(2, kLast)));
  EXPECT_TRUE(stream.note(1, sample(3, 1)));
  EXPECT_EQ(stream.lost(), 0U);
}

// It tells of the source before its publisher has told it anything.
// Or the count would begin at 0 again.
TEST(Stream, CountsNoMoreThanTheLargestNumberWhateverExportersSay) {
  constexpr std::uint64_t kMost = ~std::uint64_t{0};
  Stream stream;
  for (Incarnation exporter = 1; exporter <= 2; ++exporter) {
    EXPECT_TRUE(stream.note(exporter, event(1, false)));
    EXPECT_TRUE(stream.note(exporter, event(kMost, false)));
  }
  EXPECT_EQ(stream.lost(), kMost);
}

TEST(Stream, DoesNotMissWhatWasPublishedBeforeItsExporterJoined) {
  Stream stream;
  EXPECT_TRUE(stream.note(1, {1, 0, false, false}));
  EXPECT_TRUE(stream.note(1, sample(2, 1387)));
  EXPECT_EQ(stream.lost(), 0U);
  EXPECT_TRUE(stream.note(1, sample(4, 1389)));
  EXPECT_EQ(stream.lost(), 1U);
}

// The last event of a source waits for whoever joins, for as long as nobody does.
TEST(Stream, DoesNotMissWhatWasPublishedWhileItWasNotThere) {
  Stream stream;
  EXPECT_TRUE(stream.note(1, {100, 2000, true, false, false, true})) << "from before";
  EXPECT_TRUE(stream.note(1, {101, 2000, false, false, false, true})) << "it joins again";
  EXPECT_TRUE(stream.note(1, {102, 3000, false, false, false, true}));
  EXPECT_TRUE(stream.note(1, sample(103, 3001)));
  EXPECT_EQ(stream.lost(), 0U);
  EXPECT_TRUE(stream.note(1, {105, 3003, true, false, false, true}))
      << "it has not heard of us since";
  EXPECT_EQ(stream.lost(), 1U);
}

TEST(Stream, NothingComesTwiceOrOutOfOrder) {
  Stream stream;
  EXPECT_TRUE(stream.note(1, event(2, false)));
  EXPECT_FALSE(stream.note(1, event(2, false)));
  EXPECT_FALSE(stream.note(1, event(1, true))) << "a deactivation that was overtaken";
  EXPECT_FALSE(stream.is_deactivated());
  EXPECT_EQ(stream.doubled(), 2U);
}

// Each event that was sent has come once, or is counted as lost.
TEST(Stream, AccountsForEveryEventOfANetworkThatLosesDoublesAndReorders) {
  std::mt19937 random(3);
  for (int round = 0; round < 200; ++round) {
    std::vector<std::uint64_t> sent;
    for (std::uint64_t number = 1; number <= 200; ++number) {
      if (random() % 5 != 0) sent.push_back(number);
      if (random() % 7 == 0) sent.push_back(number);
    }
    for (std::size_t i = 0; i + 3 < sent.size(); i += 2) std::swap(sent[i], sent[i + random() % 3]);
    Stream stream;
    std::uint64_t came = 0;
    std::uint64_t first = 0;
    std::uint64_t last = 0;
    for (const std::uint64_t number : sent) {
      if (!stream.note(9, event(number, false))) continue;
      EXPECT_GT(number, last);
      if (first == 0) first = number;
      last = number;
      ++came;
    }
    EXPECT_EQ(came + stream.lost(), last - first + 1);
    EXPECT_EQ(came + stream.doubled(), sent.size());
  }
}

TEST(Stream, TheLastEventSaysWhatTheSourceIsLike) {
  Stream stream;
  stream.note(1, event(1, false));
  EXPECT_FALSE(stream.is_deactivated());
  stream.note(1, event(5, true));
  EXPECT_TRUE(stream.is_deactivated()) << "also behind a gap";
  stream.note(1, event(6, false));
  EXPECT_FALSE(stream.is_deactivated());
}

// Said again, it would end what others have begun since.
TEST(Stream, AnEndIsToBeAppliedOnce) {
  Stream stream;
  EXPECT_FALSE(stream.take_end());
  stream.note(1, event(1, true));
  stream.note(1, event(2, true));
  EXPECT_TRUE(stream.take_end());
  EXPECT_FALSE(stream.take_end());
  stream.note(1, event(3, true));
  EXPECT_FALSE(stream.take_end()) << "it is the same one";
  stream.note(1, event(4, false));
  stream.note(1, event(5, true));
  EXPECT_TRUE(stream.take_end()) << "it is another one";
  stream.note(1, event(6, false));
  stream.note(1, event(7, true));
  stream.note(1, event(8, false));
  EXPECT_FALSE(stream.take_end()) << "it is over";
  stream.note(2, event(1, true));
  EXPECT_TRUE(stream.take_end()) << "nothing is known of what was before";
  stream.obey(1);
  stream.note(1, event(9, true));
  EXPECT_TRUE(stream.take_end());
  stream.obey(2);
  EXPECT_FALSE(stream.take_end());
}

TEST(Stream, ALinkThatWasStartedAgainBeginsAgain) {
  Stream stream;
  stream.note(1, event(100, false));
  EXPECT_TRUE(stream.note(2, event(1, true)));
  EXPECT_TRUE(stream.is_deactivated());
  EXPECT_EQ(stream.lost(), 0U);
}

// A host that is obeyed again, after another one was, sends its last event once more.
TEST(Stream, WhatASpeakerThatComesBackSendsAgainIsKnown) {
  Stream stream;
  stream.note(1, event(100, false));
  stream.note(2, event(1, false));
  EXPECT_FALSE(stream.note(1, event(100, false)));
  EXPECT_TRUE(stream.note(1, event(120, false)));
  EXPECT_EQ(stream.lost(), 0U) << "what it sent while another one was obeyed is not missed";
  EXPECT_TRUE(stream.note(1, event(122, false)));
  EXPECT_EQ(stream.lost(), 1U);
}

// Of another one that was obeyed meanwhile nothing stays: not even if nothing new comes.
TEST(Stream, ASpeakerThatIsObeyedAgainHasTheStateOfItsOwnLastEvent) {
  Stream stream;
  stream.obey(1);
  stream.note(1, event(100, true));
  stream.obey(2);
  EXPECT_FALSE(stream.is_deactivated()) << "nothing is known of it yet";
  stream.note(2, event(1, false));
  stream.obey(1);
  EXPECT_TRUE(stream.is_deactivated());
  EXPECT_FALSE(stream.note(1, event(100, true)));
  EXPECT_TRUE(stream.is_deactivated());
  stream.obey(2);
  EXPECT_FALSE(stream.is_deactivated());
  EXPECT_TRUE(stream.note(2, event(5, false)));
  EXPECT_EQ(stream.lost(), 0U) << "what it sent while another one was obeyed is not missed";
}

// A component of this host has the source open meanwhile.
TEST(Stream, DoesNotMissWhatWasSentWhileNobodyListened) {
  Stream stream;
  stream.obey(1);
  EXPECT_TRUE(stream.note(1, sample(1, 500)));
  EXPECT_TRUE(stream.note(1, sample(2, 501)));
  stream.pause();
  stream.obey(1);
  EXPECT_TRUE(stream.note(1, sample(90, 589))) << "of all that came, the last";
  EXPECT_EQ(stream.lost(), 0U);
  EXPECT_TRUE(stream.note(1, sample(91, 590)));
  EXPECT_EQ(stream.lost(), 0U);
  EXPECT_TRUE(stream.note(1, sample(94, 593)));
  EXPECT_EQ(stream.lost(), 2U) << "it is listened to again";
  stream.pause();
  EXPECT_FALSE(stream.note(1, sample(94, 593))) << "what it knew before it still knows";
}

TEST(Stream, MissesWhatWasSentWhileItWasCutOff) {
  Stream stream;
  stream.obey(1);
  EXPECT_TRUE(stream.note(1, sample(2, 501)));
  stream.obey(1);
  EXPECT_TRUE(stream.note(1, sample(5, 504)));
  EXPECT_EQ(stream.lost(), 2U);
}

TEST(Speaker, IsKeptUntilItIsGone) {
  Speaker speaker;
  EXPECT_EQ(speaker.current(), nullptr);
  speaker.add({1, "head", 11});
  speaker.add({2, "base", 22});
  EXPECT_EQ(speaker.current()->host, "head") << "whoever comes meanwhile";
  EXPECT_THAT(speaker.hosts(), ElementsAre("base", "head"));
  speaker.remove(2);
  EXPECT_EQ(speaker.current()->host, "head");
  speaker.add({3, "base", 22});
  speaker.remove(1);
  EXPECT_EQ(speaker.current()->key, 3U);
  speaker.remove(3);
  EXPECT_EQ(speaker.current(), nullptr);
}

TEST(Speaker, OfSeveralTheFirstByNameFollows) {
  Speaker speaker;
  speaker.add({1, "head", 11});
  speaker.add({2, "rear", 22});
  speaker.add({3, "base", 33});
  speaker.remove(1);
  EXPECT_EQ(speaker.current()->host, "base");
}

// A link that was killed is believed to live until its lease ends; its successor is the same host.
TEST(Speaker, TheNextLifeOfAHostTakesItsPlace) {
  Speaker speaker;
  speaker.add({1, "head", 11});
  speaker.add({2, "head", 12});
  EXPECT_EQ(speaker.current()->incarnation, 12U);
  EXPECT_THAT(speaker.hosts(), ElementsAre("head"));
  speaker.remove(1);
  EXPECT_EQ(speaker.current()->incarnation, 12U);
  speaker.add({2, "head", 12});
  speaker.remove(2);
  EXPECT_EQ(speaker.current(), nullptr) << "a key counts once";
}

TEST(Speaker, AnotherHostsNextLifeDoesNotTakeOver) {
  Speaker speaker;
  speaker.add({1, "head", 11});
  speaker.add({2, "base", 22});
  speaker.add({3, "base", 23});
  EXPECT_EQ(speaker.current()->key, 1U);
  speaker.remove(1);
  EXPECT_EQ(speaker.current()->key, 3U) << "of its lives the last";
}

TEST(ImportChoice, OnlyWhatIsWantedHereOfferedThereAndNotOpenHereIsImported) {
  int imported = 0;
  for (const bool wanted : {false, true}) {
    for (const bool here : {false, true}) {
      for (const bool offered : {false, true}) {
        if (choose_import({wanted, here, offered}) == ImportChoice::kImport) {
          EXPECT_TRUE(wanted && !here && offered);
          ++imported;
        }
      }
    }
  }
  EXPECT_EQ(imported, 1);
}

// For `forever` nothing else ends what a speaker that is gone has begun (docs/hosts.md).
TEST(ImportChoice, ThePortIsHeldNoLongerThanThereIsASpeaker) {
  Speaker speaker;
  speaker.add({1, "head", 11});
  EXPECT_EQ(choose_import({true, false, speaker.current() != nullptr}), ImportChoice::kImport);
  speaker.remove(1);
  EXPECT_EQ(choose_import({true, false, speaker.current() != nullptr}), ImportChoice::kNoSpeaker);
}

}  // namespace
}  // namespace arbiter::link
