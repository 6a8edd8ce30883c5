// Which samples the thread that receives them may send, and what a latched topic keeps.
#include "gateway/dds/out_topic.hpp"

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "gateway/dds/opaque_type.hpp"
#include "gateway/dds/reader_cache.hpp"
#include "tests/gateway/dds/own_domain.hpp"
#include "tests/gateway/dds/scene.hpp"
#include "tests/gateway/mapping_text.hpp"
#include "tests/support/await.hpp"

namespace {

int waits_for_acks = 0;

}  // namespace

// Called in place of Cyclone's.
extern "C" dds_return_t dds_wait_for_acks(dds_entity_t writer, dds_duration_t timeout) {
  static const auto real =
      reinterpret_cast<decltype(&dds_wait_for_acks)>(::dlsym(RTLD_NEXT, "dds_wait_for_acks"));
  ++waits_for_acks;
  return real(writer, timeout);
}

namespace arbiter::gateway::dds {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;
constexpr shm::Nanoseconds kMillisecond = 1'000'000;

TEST(OutTopic, TakesSamplesOf64KiBAndTheirHeaderAtOnceAndNoLargerOnesAtFirst) {
  const Read read = read_dds("<out port='/Base/cmd:i' topic='/cmd' type='a/msg/B'/>");
  Account account(read.entry().outside(), "subscriber");
  const Bell bell;
  const OutTopic topic(read.entry(), account, bell);
  const Sender& sender = topic;
  EXPECT_EQ(sender.largest_at_once(), 4u + 65'536u);
}

// A topic on its way out, and those who come later and want what was sent before.
class Latched : public ::testing::Test {
 protected:
  // The rest of the entry.
  void make(const std::string& more) {
    read_.emplace(read_text(
        "<gateway kind='dds' interface='lo' domain='" + std::to_string(number_.number()) +
        "'><out port='/Base/cmd:i' topic='/cmd' type='a/msg/B' " + more + "/></gateway>"));
    account_.emplace(entry().outside(), "subscriber");
    domain_.emplace(read_->mapping.gateways.at(0), std::set<std::string>{"rt/cmd"}, bell_);
    topic_.emplace(entry(), *account_, bell_);
    topic_->open(*domain_);
  }
  [[nodiscard]] const Entry& entry() const { return read_->entry(); }
  [[nodiscard]] const Account& account() const { return *account_; }
  Sender::Result send(const std::string& bytes) {
    return topic_->send(Bytes(reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()));
  }
  void open_again() {
    topic_->close();
    topic_->open(*domain_);
  }
  // As with another mapping.
  void begin_anew() {
    LatchedSamples latched;
    latched.put("name", topic_->take_last());
    topic_.emplace(entry(), *account_, bell_);
    topic_->begin_with(latched.take("name"));
    topic_->open(*domain_);
  }
  // In a process of its own; it is matched.
  test::Stranger subscriber() {
    test::Stranger result("cyclone", number_,
                          {"sub", "blob", "rt/cmd", "name=a::msg::dds_::B_",
                           "durability=transient_local", "depth=1"});
    result.await("matched 1");
    test::await([&] {
      topic_->look_at({});
      return account().may_have_peers();
    });
    return result;
  }
  // What a reader is given that comes now: within a process at once.
  std::vector<std::string> given() {
    const Entity participant(dds_create_participant(number_.number(), nullptr, nullptr),
                             "participant");
    ddsi_sertype* type = make_opaque_type(entry().dds->type, false);
    const Entity topic(
        dds_create_topic_sertype(participant.get(), "rt/cmd", &type, nullptr, nullptr, nullptr),
        "topic");
    Qos qos;
    qos.durability = Durability::kTransientLocal;
    Kept kept;
    ReaderCache cache(kept);
    const Entity reader(
        dds_create_reader_rhc(participant.get(), topic.get(), cyclone_qos(qos, End::kReader).get(),
                              nullptr, cache.cache()),
        "reader");
    return kept.all;
  }

  const std::string one_{"\0\1\0\0one.", 8};
  const std::string two_{"\0\1\0\0two.", 8};
  std::optional<OutTopic> topic_;

 private:
  class Kept : public SampleTaker {
   public:
    void take(const Payload& payload, const SampleWriter& /*writer*/) noexcept override {
      all.emplace_back(reinterpret_cast<const char*>(payload.bytes()), payload.size);
    }
    std::vector<std::string> all;
  };

  const test::OwnDomain number_;
  const Bell bell_;
  std::optional<Read> read_;
  std::optional<Account> account_;
  std::optional<Domain> domain_;
};

// Its port is another gateway's, say: that one tells who else is at the topic.
TEST_F(Latched, OfATopicThatIsNotServedNobodyIsSaidToGoPastArbiter) {
  make("");
  PeersOfTopic peers;
  Peer& other = peers.ends[Guid{1}];
  other.end = End::kWriter;
  other.type = entry().dds->type;
  other.owner = "nav (pid 12)";
  other.qos = announced_by(Qos{}, End::kWriter);
  topic_->look_at(peers);
  EXPECT_THAT(account().text(), testing::Not(testing::HasSubstr("past Arbiter")));
}

TEST_F(Latched, WhatElseIsAtATopicDoesNotHideThatNobodySubscribes) {
  make("");
  PeersOfTopic peers;
  peers.crowds[End::kWriter].has_more = true;
  topic_->look_at(peers);
  EXPECT_EQ(account().text(),
            "DDS topic rt/cmd, no subscriber matched; there are more ends than the gateway looks "
            "at");
  EXPECT_FALSE(account().is_trouble());
}

// Whoever is in another partition is probably meant to be.
TEST_F(Latched, WhoDoesNotMatchIsTroubleUnlessInAnotherPartition) {
  make("reliability='best_effort'");
  PeersOfTopic peers;
  Peer& other = peers.ends[Guid{1}];
  other.type = "a::msg::dds_::B_";
  other.qos.reliability = 1;
  other.qos.representations = {0};
  other.qos.partitions = {"elsewhere"};
  topic_->look_at(peers);
  EXPECT_FALSE(account().is_trouble()) << account().text();
  other.qos.partitions = {};
  ++peers.revision;
  topic_->look_at(peers);
  EXPECT_TRUE(account().is_trouble()) << account().text();
}

TEST_F(Latched, WhatWasSentLastIsStillThereWhenTheWriterIsOpenedAgain) {
  make("qos='latched'");
  EXPECT_EQ(send(one_), Sender::Result::kSent);
  EXPECT_EQ(send(two_), Sender::Result::kSent);
  for (int i = 0; i < 2; ++i) {
    EXPECT_THAT(given(), testing::ElementsAre(two_));
    open_again();
  }
  begin_anew();
  EXPECT_THAT(given(), testing::ElementsAre(two_));
  EXPECT_EQ(send(one_), Sender::Result::kSent);
  EXPECT_THAT(given(), testing::ElementsAre(one_));
}

// A pause that has ended meanwhile must not come back.
TEST_F(Latched, WhatWasToBeSentWhileTheWriterWasClosedIsThereWhenItIsOpen) {
  make("qos='latched'");
  EXPECT_EQ(send(one_), Sender::Result::kSent);
  topic_->close();
  EXPECT_EQ(send(two_), Sender::Result::kNotReady);
  EXPECT_EQ(send("no header"), Sender::Result::kRefused);
  open_again();
  EXPECT_THAT(given(), testing::ElementsAre(two_));
  topic_->close();
  EXPECT_EQ(send(one_), Sender::Result::kNotReady);
  begin_anew();
  EXPECT_THAT(given(), testing::ElementsAre(one_));
}

// Otherwise the writer would keep all that it has ever sent, and whoever comes later be given it.
TEST_F(Latched, WhoKeepsAllForThoseWhoAreThereGivesThoseWhoComeLaterTheLastSampleAlone) {
  make("qos='latched' history='keep_all'");
  EXPECT_EQ(send(one_), Sender::Result::kSent);
  EXPECT_EQ(send(two_), Sender::Result::kSent);
  EXPECT_THAT(given(), ::testing::ElementsAre(two_));
}

TEST_F(Latched, WhatIsNotLatchedIsNot) {
  make("");
  EXPECT_EQ(send(one_), Sender::Result::kSent);
  open_again();
  EXPECT_FALSE(topic_->latches());
  EXPECT_FALSE(topic_->take_last());
}

// Cyclone lets half of this wait for an acknowledgement where nothing may be overwritten. Who comes
// later must not be told that the robot may go once it is to stop.
TEST_F(Latched, WhatTheWriterHadNoRoomForIsThereOnceItHas) {
  make("qos='latched' history='keep_all'");
  const std::string large = one_ + std::string(kMiB, '.');
  test::Stranger slow = subscriber();
  slow.process().stop();
  EXPECT_EQ(send(large), Sender::Result::kSent);
  EXPECT_EQ(send(two_), Sender::Result::kRefused);
  topic_->look_at({});
  EXPECT_TRUE(given().back() == large);
  slow.process().resume();
  test::await([&] {
    topic_->look_at({});
    return given().back() == two_;
  });
}

// The gateway's loop waits, and with it all ports: a subscriber that is cut off may be there for as
// long as its lease says.
TEST_F(Latched, AWriterThatHasWaitedInVainDoesNotWaitAgainUntilThereIsRoom) {
  make("qos='latched' history='keep_all'");
  const std::string large = one_ + std::string(kMiB, '.');
  test::Stranger slow = subscriber();
  for (int time = 0; time < 2; ++time) {
    slow.process().stop();
    const int before = waits_for_acks;
    while (send(large) == Sender::Result::kSent) continue;
    const int waits = waits_for_acks;
    for (int i = 0; i < 10; ++i) EXPECT_EQ(send(two_), Sender::Result::kRefused);
    EXPECT_EQ(waits_for_acks, waits);
    EXPECT_GT(waits, before) << "there was room in between";
    slow.process().resume();
    test::await([&] { return send(two_) == Sender::Result::kSent; });
  }
}

// A base that comes then must not drive off by a command of before.
TEST_F(Latched, WhereThereIsAnIdleSampleACommandOfBeforeIsNotSentOnceAnotherWasToBe) {
  make("qos='latched' idle='zero' size='4'");
  EXPECT_EQ(send(one_), Sender::Result::kSent);
  open_again();
  EXPECT_THAT(given(), testing::ElementsAre(one_)) << "somebody commands still";
  topic_->close();
  EXPECT_EQ(send(two_), Sender::Result::kNotReady);
  open_again();
  EXPECT_THAT(given(), testing::IsEmpty());
  EXPECT_EQ(send(one_), Sender::Result::kSent);
  begin_anew();
  EXPECT_THAT(given(), testing::IsEmpty());
}

TEST(Pace, WhatIsSentFastMayBeSentAtOnce) {
  Pace pace;
  for (int i = 0; i < 20; ++i) pace.note(kMiB, kMillisecond);
  EXPECT_GT(pace.largest(), kMiB);
  EXPECT_LE(pace.largest(), 2 * kMiB);
}

// The socket's buffer may have taken it.
TEST(Pace, ASampleSaysNothingOfOneThatIsMuchLarger) {
  Pace pace;
  for (int i = 0; i < 100; ++i) pace.note(kMiB / 8, kMillisecond / 1000);
  EXPECT_LE(pace.largest(), kMiB / 4);
}

// 8 MiB at 1 Gbit/s: an emergency stop would wait as long.
TEST(Pace, WhatTakesTooLongIsNot) {
  Pace pace;
  for (int i = 0; i < 100; ++i) pace.note(8 * kMiB, 65 * kMillisecond);
  EXPECT_LT(pace.largest(), kMiB);
  EXPECT_GT(pace.largest(), Pace::kAlways);
}

TEST(Pace, ASlowOneCountsAtOnceAndAFastOneByAndBy) {
  Pace pace;
  for (int i = 0; i < 20; ++i) pace.note(kMiB, kMillisecond);
  pace.note(kMiB, 4 * kMillisecond);
  EXPECT_LE(pace.largest(), kMiB / 2);
  pace.note(kMiB, kMillisecond);
  EXPECT_LT(pace.largest(), kMiB);
  pace.note(kMiB, kMillisecond);
  pace.note(kMiB, kMillisecond);
  EXPECT_GT(pace.largest(), kMiB);
}

TEST(Pace, StaysWithinItsBounds) {
  Pace pace;
  pace.note(kMiB, 1000 * kMillisecond);
  EXPECT_EQ(pace.largest(), Pace::kAlways);
  for (int i = 0; i < 100; ++i) pace.note(1000 * kMiB, 0);
  EXPECT_LE(pace.largest(), 2000 * kMiB);
}

}  // namespace
}  // namespace arbiter::gateway::dds
