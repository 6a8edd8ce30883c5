// What a gateway says of an entry.
#include "gateway/core/account.hpp"

#include <gmock/gmock.h>

#include <cstdint>
#include <set>
#include <string>

#include "gateway/core/pauses.hpp"

namespace arbiter::gateway {
namespace {

using testing::HasSubstr;

TEST(Account, SaysWhatItIsAndWhoIsMatched) {
  Account account("DDS topic rt/cmd_vel", "publisher");
  EXPECT_EQ(account.text(), "DDS topic rt/cmd_vel");
  account.set_peers(0);
  EXPECT_EQ(account.text(), "DDS topic rt/cmd_vel, no publisher matched");
  account.set_peers(1);
  EXPECT_EQ(account.text(), "DDS topic rt/cmd_vel, 1 publisher matched");
  account.set_peers(2);
  EXPECT_EQ(account.text(), "DDS topic rt/cmd_vel, 2 publishers matched");
}

TEST(Account, SaysWhatWentWrongAndWhyLast) {
  Account account("iceoryx a/b/c", "subscriber");
  account.set_peers(1);
  account.late.add();
  account.late.add();
  account.too_large.add();
  account.set_last_reason("a sample of 70000 bytes");
  EXPECT_EQ(account.text(),
            "iceoryx a/b/c, 1 subscriber matched; 2 late, 1 of a size that does not fit; a sample "
            "of 70000 bytes");
  EXPECT_EQ(account.state(), "iceoryx a/b/c, 1 subscriber matched; a sample of 70000 bytes");
}

TEST(Account, SaysHowLargeTheLastSampleWas) {
  Account account("DDS topic rt/image", "publisher");
  account.set_peers(1);
  account.passed.add();
  account.set_last_size(921'632);
  EXPECT_EQ(account.text(),
            "DDS topic rt/image, 1 publisher matched, the last sample has 921632 bytes");
  EXPECT_EQ(account.state(), "DDS topic rt/image, 1 publisher matched");
}

constexpr std::int64_t kSecond = 1'000'000'000;

// Half a second later, and as many samples.
void pass(Account& account, std::int64_t& now, int samples) {
  for (int i = 0; i < samples; ++i) account.passed.add();
  account.look(now += kSecond / 2);
}

TEST(Account, SaysHowManySamplesPassInASecondAndSinceWhenNone) {
  Account account("DDS topic rt/cmd_vel", "publisher");
  account.set_last_size(52);
  std::int64_t now = 100 * kSecond;
  for (int i = 0; i < 9; ++i) pass(account, now, 10);
  EXPECT_EQ(account.text(), "DDS topic rt/cmd_vel, 20 samples a second, the last one has 52 bytes");
  for (int i = 0; i < 9; ++i) pass(account, now, 0);
  EXPECT_EQ(account.text(), "DDS topic rt/cmd_vel, the last sample has 52 bytes");
  account.look(now += 6 * kSecond);
  EXPECT_EQ(account.text(),
            "DDS topic rt/cmd_vel, the last sample has 52 bytes and is over 10 s old");
  account.look(now += 3600 * kSecond);
  EXPECT_EQ(account.text(),
            "DDS topic rt/cmd_vel, the last sample has 52 bytes and is over an hour old");
}

TEST(Account, WhatAQueueHasLostIsSaidAsTheLeastThatItCanBe) {
  Account account("iceoryx a/b/c", "publisher");
  account.late.add();
  account.overflows.add();
  account.overflows.add();
  EXPECT_EQ(account.text(), "iceoryx a/b/c; 1 late, 2 or more lost to a full queue");
}

// Each text that is another one goes to the daemon, and to all who look.
TEST(Account, ASteadyTopicDoesNotChangeItsText) {
  Account account("DDS topic rt/cmd_vel", "subscriber");
  std::int64_t now = 100 * kSecond;
  std::set<std::string> texts;
  for (int i = 0; i < 1000; ++i) {
    pass(account, now, 4 + i % 3);
    account.idle.add();
    if (i >= 8) texts.insert(account.text());
  }
  EXPECT_THAT(texts, testing::SizeIs(testing::Le(4u))) << testing::PrintToString(texts);
  EXPECT_THAT(account.text(), HasSubstr("10 samples a second"));
  EXPECT_THAT(account.text(), HasSubstr("at least 1000 idle samples"));
}

// Its first sample came within the time that is counted, and it slows down a little later.
TEST(Account, ARateBecomesRight) {
  Account account("DDS topic rt/heartbeat", "publisher");
  std::int64_t now = 100 * kSecond;
  pass(account, now, 0);
  pass(account, now, 3);
  for (int i = 0; i < 4; ++i) pass(account, now, 5);
  EXPECT_THAT(account.text(), HasSubstr(", 10 samples a second"));
  for (int i = 0; i < 40; ++i) pass(account, now, 25);
  EXPECT_THAT(account.text(), HasSubstr(", 50 samples a second"));
  for (int i = 0; i < 100; ++i) pass(account, now, 20 + i % 2);
  EXPECT_THAT(account.text(), HasSubstr(", 41 samples a second"));
}

TEST(Account, OneSampleASecondHasARateAndSteadily) {
  Account account("DDS topic rt/heartbeat", "publisher");
  std::int64_t now = 100 * kSecond;
  std::set<std::string> texts;
  for (int i = 0; i < 1000; ++i) {
    pass(account, now, i % 2);
    now += kSecond / 100;  // looks come a little late
    if (i >= 100) texts.insert(account.text());
  }
  EXPECT_THAT(texts, testing::ElementsAre(HasSubstr(", 1 sample a second")));
}

// Somebody may send two kinds of bad samples in turn, for a year.
TEST(Pauses, BecomeLongerWhileSomethingIsSaidAgainAndAgain) {
  Pauses pauses;
  std::int64_t now = 1000 * kSecond;
  const auto lines_within = [&](std::int64_t seconds) {
    int lines = 0;
    for (const std::int64_t end = now + seconds * kSecond; now < end; now += kSecond / 2) {
      if (!pauses.is_over(now)) continue;
      pauses.begin(now);
      ++lines;
    }
    return lines;
  };
  EXPECT_GE(lines_within(10), 4);
  EXPECT_LE(lines_within(86'400), 1500);
  now += 2 * Pauses::kLongest + kSecond;  // nothing has changed
  EXPECT_GE(lines_within(10), 4);
}

TEST(News, OfStrangersThatComeAndGoForEverIsSaidEverMoreSeldom) {
  News news;
  std::int64_t now = 1000 * kSecond;
  EXPECT_TRUE(news.take("one", now));
  EXPECT_FALSE(news.take("one", now += Pauses::kLongest)) << "it was said";
  EXPECT_FALSE(news.take("", ++now)) << "there is nothing to be said";
  EXPECT_TRUE(news.take("one", ++now)) << "it is true again";
  EXPECT_FALSE(news.take("another", ++now));
  EXPECT_TRUE(news.take("another", now += 2 * Pauses::kShortest)) << "if it is still true";
  int lines = 0;
  for (int i = 0; i < 86'400; ++i) lines += news.take(i % 2 == 0 ? "" : "one", now += kSecond);
  EXPECT_LE(lines, 1500);
}

TEST(Account, AnObstacleStandsInThePlaceOfPeers) {
  Account account("iceoryx a/b/c", "subscriber");
  account.set_peers(3);
  account.set_obstacle("RouDi does not run");
  EXPECT_EQ(account.text(), "iceoryx a/b/c, RouDi does not run");
  EXPECT_TRUE(account.is_trouble());
  account.set_obstacle("there are many ends", false);
  EXPECT_FALSE(account.is_trouble());
  account.set_obstacle("");
  EXPECT_FALSE(account.is_trouble());
  EXPECT_EQ(account.text(), "iceoryx a/b/c, 3 subscribers matched");
}

TEST(Account, WhatToDoAboutAnObstacleIsNotCut) {
  Account account("DDS topic rt/cmd_vel_nav", "publisher");
  account.set_obstacle(std::string(330, 'x') + "; write reliability=\"best_effort\"");
  EXPECT_THAT(account.text(), testing::EndsWith("x; write reliability=\"best_effort\""));
}

TEST(Account, WhatStrangersSayIsEscapedAndBounded) {
  Account account("iceoryx \x1b[2J/b/c", "publisher");
  account.set_last_reason(std::string(10'000, 'x') + "\n");
  const std::string text = account.text();
  EXPECT_LE(text.size(), kMaxDescription);
  EXPECT_THAT(text, HasSubstr("\\x1b[2J"));
  EXPECT_THAT(text, testing::EndsWith("..."));
}

}  // namespace
}  // namespace arbiter::gateway
