// A large sample that goes straight on is copied once: to the middleware's memory, and to Arbiter's
// only if somebody reads it there. What is sent is that sample and no other.
#include <gmock/gmock.h>

#include <string>

#include <arbiter/arbiter.hpp>

#include "gateway/core/incoming.hpp"
#include "gateway/core/outgoing.hpp"
#include "shm/clock.hpp"
#include "tests/gateway/foreign.hpp"
#include "tests/gateway/mapping_text.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::gateway {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::size_t kSize = 100'000;  // more than a few blocks, and not a whole number of them

// No two blocks are equal.
std::string large(char name) {
  std::string bytes(kSize, name);
  for (std::size_t i = 0; i < bytes.size(); i += 7) bytes[i] = static_cast<char>(i >> 7);
  return bytes;
}

class Drafts : public testing::Test {
 protected:
  Drafts() {
    feeds_.emplace("/Nav/cmd:o", &nav_.feed());
    outgoing_.lead(feeds_, [] {});
    sender_.drafts = true;
    outgoing_.run(shm::monotonic_now());
    deliver("first");
    outgoing_.run(shm::monotonic_now());
    sender_.sent.clear();
  }

  Incoming::Fate deliver(const std::string& bytes, Time deadline = Time::max()) {
    return nav_.deliver(BytesSample(bytes), deadline);
  }

  test::Daemon daemon_{
      "<behaviors timeout='1000s'>"
      "<behavior name='Navigate'><config at='/Base/cmd:i'>/Nav/cmd:o</config></behavior>"
      "<behavior name='Stop'><config at='/Base/cmd:i'>/Stop/cmd:o</config>"
      "<inhibition>Navigate</inhibition></behavior>"
      "<behavior name='Show'><config at='/Display/cmd:i'>/Nav/cmd:o</config></behavior>"
      "<behavior name='Hush'><config at='/Display/cmd:i'>/Hush/cmd:o</config>"
      "<inhibition>Show</inhibition></behavior>"
      "<behavior name='Log'><config at='/Log/cmd:i'>/Nav/cmd:o</config></behavior></behaviors>"};
  Read read_ = read_dds(
      "<in topic='/nav' type='a/msg/B' port='/Nav/cmd:o' max_size='128KiB'/>"
      "<out port='/Base/cmd:i' topic='/cmd' type='a/msg/B' max_size='128KiB'/>");
  Account nav_account_{"nav", "publisher"};
  Account account_{"cmd", "subscriber"};
  KeepingSender sender_;
  OneAge ages_;
  FeedBySource feeds_;
  Node node_{"gateway"};
  Incoming nav_{node_, read_.entry(0), nav_account_};
  Outgoing outgoing_{node_, read_.entry(1), sender_, account_, ages_};
  const int descriptor_ = outgoing_.descriptor();
};

TEST_F(Drafts, ALargeSampleIsSentFromItsDraft) {
  EXPECT_EQ(deliver(large('a')), Incoming::Fate::kPassed);
  EXPECT_EQ(deliver(large('b')), Incoming::Fate::kPassed);
  EXPECT_THAT(sender_.sent, ElementsAre(large('a'), large('b')));
  EXPECT_EQ(sender_.sent_drafts, 2);
  EXPECT_EQ(sender_.dropped_drafts, 0);
  EXPECT_EQ(account_.passed.value(), 3u);
}

TEST_F(Drafts, ItIsCopiedOnceWhereNobodyElseReadsIt) {
  const BytesSample sample(large('a'));
  EXPECT_EQ(nav_.deliver(sample, Time::max()), Incoming::Fate::kPassed);
  EXPECT_EQ(sample.copied, kSize);
  EXPECT_EQ(sender_.sent_drafts, 1);
}

std::string text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST_F(Drafts, ATapSeesItToo) {
  Node watcher{"watcher"};
  auto tap = watcher.tap("/Nav/cmd:o");
  deliver(large('a'));
  EXPECT_THAT(sender_.sent, ElementsAre(large('a')));
  std::string seen;
  while (auto event = tap.take()) {
    if (const auto bytes = event->sample()) seen = text_of(*bytes);
  }
  EXPECT_TRUE(seen == large('a'));
}

TEST_F(Drafts, AnotherComponentIsHandedItToo) {
  Node component{"logger"};
  auto log = component.input_port("/Log/cmd:i");
  deliver(large('a'));
  deliver(large('b'));
  EXPECT_THAT(sender_.sent, ElementsAre(large('a'), large('b')));
  EXPECT_TRUE(text_of(**log.take()) == large('a'));
  EXPECT_TRUE(text_of(**log.take()) == large('b'));
}

// A port that comes makes the source's memory grow, and what lies in memory that the gateway's own
// port does not know yet, it is handed as a copy: before the end of the turn.
TEST_F(Drafts, ADraftThatIsLeftIsWhatTheLoopSendsWhereverItsSampleLies) {
  auto hush = node_.output_port("/Hush/cmd:o", Type::variable("a/msg/B", kSize));
  hush.signal();
  const std::string small = large('a').substr(0, 5000);
  for (int i = 0; i < 20; ++i) {
    Node component{"display"};
    auto display = component.input_port("/Display/cmd:i");
    sender_.would_wait = true;
    deliver(small);
    sender_.would_wait = false;
    outgoing_.run(shm::monotonic_now());
    EXPECT_THAT(sender_.sent, ElementsAre(small));
    sender_.sent.clear();
  }
}

// Another source's sample is the loop's, and what comes behind it, too.
TEST_F(Drafts, ADraftBehindAnothersSampleIsSentByTheLoop) {
  auto stop = node_.output_port("/Stop/cmd:o", Type::variable("a/msg/B", kSize));
  sender_.largest = 1;  // not straight on
  deliver(large('a'));
  stop.publish(Bytes(reinterpret_cast<const std::byte*>("stop"), 4));
  stop.deactivate();
  sender_.largest = SIZE_MAX;
  sender_.meanwhile = [&] {
    sender_.meanwhile = nullptr;
    stop.signal();
  };
  deliver(large('b'));
  stop.deactivate();
  EXPECT_THAT(sender_.sent, ElementsAre(large('a')));
  EXPECT_EQ(sender_.dropped_drafts, 1);
  outgoing_.run(shm::monotonic_now());
  EXPECT_THAT(sender_.sent, ElementsAre(large('a'), "stop", large('b')));
}

TEST_F(Drafts, ASmallSampleHasNone) {
  deliver("small");
  EXPECT_THAT(sender_.sent, ElementsAre("small"));
  EXPECT_EQ(sender_.drafted, 0);
}

TEST_F(Drafts, WhatIsLateLeavesNothingBehind) {
  EXPECT_EQ(deliver(large('a'), Time::min()), Incoming::Fate::kLate);
  EXPECT_EQ(sender_.dropped_drafts, 1);
  EXPECT_THAT(sender_.sent, IsEmpty());
}

TEST_F(Drafts, WhatCannotBeReadLeavesNothingBehind) {
  BytesSample sample(large('a'));
  sample.is_broken = true;
  EXPECT_EQ(nav_.deliver(sample, Time::max()), Incoming::Fate::kUnreadable);
  EXPECT_EQ(sender_.dropped_drafts, 1);
  EXPECT_THAT(sender_.sent, IsEmpty());
}

TEST_F(Drafts, TheDraftOfALoserIsDropped) {
  auto stop = node_.output_port("/Stop/cmd:o", Type::variable("a/msg/B", kSize));
  stop.signal();
  deliver(large('a'));
  EXPECT_THAT(sender_.sent, IsEmpty());
  EXPECT_EQ(sender_.dropped_drafts, 1);
}

// One that has waited since before the turn is of the same size, and comes first.
TEST_F(Drafts, AnEarlierSampleOfTheSourceIsNotTakenForTheDraft) {
  sender_.largest = 1;  // not straight on
  deliver(large('a'));
  sender_.largest = SIZE_MAX;
  deliver(large('b'));
  EXPECT_THAT(sender_.sent, ElementsAre(large('a'), large('b')));
  EXPECT_EQ(sender_.sent_drafts, 1);
}

// A source that is opened again counts from the beginning.
TEST_F(Drafts, NorIsOneOfItsPredecessorThatHasItsNumber) {
  const Read stop =
      read_dds("<in topic='/stop' type='a/msg/B' port='/Stop/cmd:o' max_size='128KiB'/>");
  {
    Incoming predecessor(node_, stop.entry(), nav_account_);
    predecessor.deliver(BytesSample(large('a')), Time::max());
  }
  Incoming successor(node_, stop.entry(), nav_account_);
  feeds_.emplace("/Stop/cmd:o", &successor.feed());
  successor.feed().follow(outgoing_);
  successor.deliver(BytesSample(large('b')), Time::max());
  EXPECT_THAT(sender_.sent, ElementsAre(large('a'), large('b')));
  EXPECT_EQ(sender_.sent_drafts, 1);
}

// What overrides it while the first of the two is sent, overrides it.
TEST_F(Drafts, ASampleThatIsOverriddenBeforeItIsTakenIsNotSent) {
  auto stop = node_.output_port("/Stop/cmd:o", Type::variable("a/msg/B", kSize));
  sender_.largest = 1;
  deliver(large('a'));
  sender_.largest = SIZE_MAX;
  sender_.meanwhile = [&] { stop.signal(); };
  deliver(large('b'));
  EXPECT_THAT(sender_.sent, ElementsAre(large('a')));
  EXPECT_EQ(sender_.sent_drafts, 0);
  EXPECT_EQ(sender_.dropped_drafts, 1);
}

TEST_F(Drafts, ADraftThatCannotBeSentAtOnceIsLeftToTheLoop) {
  sender_.would_wait = true;
  deliver(large('a'));
  EXPECT_THAT(sender_.sent, IsEmpty());
  sender_.would_wait = false;
  outgoing_.run(shm::monotonic_now());
  EXPECT_THAT(sender_.sent, ElementsAre(large('a')));
  EXPECT_EQ(sender_.sent_drafts, 0);
  EXPECT_EQ(sender_.dropped_drafts, 1);
}

// What comes next is sent as it is.
TEST_F(Drafts, ADraftThatGrowsTooOldUntilTheLoopComesIsDropped) {
  sender_.would_wait = true;
  deliver(large('a'));
  sender_.would_wait = false;
  ages_.age = 0;
  outgoing_.run(shm::monotonic_now());
  EXPECT_EQ(sender_.dropped_drafts, 1);
  ages_.age = shm::kForever;
  sender_.largest = 1;  // not straight on
  deliver(large('b'));
  outgoing_.run(shm::monotonic_now());
  EXPECT_THAT(sender_.sent, ElementsAre(large('b')));
}

}  // namespace
}  // namespace arbiter::gateway
