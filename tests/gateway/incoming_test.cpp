// Samples from outside become arrivals: at one source, or at the one of two that a field chooses.
#include <gmock/gmock.h>

#include <chrono>

#include <arbiter/arbiter.hpp>

#include "gateway/core/max_ages.hpp"
#include "tests/gateway/foreign.hpp"
#include "tests/gateway/mapping_text.hpp"
#include "tests/realtime/allocations.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::gateway {
namespace {

using Fate = Incoming::Fate;
constexpr Time kPassed{};
constexpr Time kNever = Time::max();

constexpr const char* kArrivals =
    "<behaviors timeout='10s'>"
    "<behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o</config></behavior>"
    "<behavior name='Stop'><config at='/Brake:i'>/pressed:o</config>"
    "<condition>not /released:o and not /other/released:o and not /other/pressed:o</condition>"
    "</behavior></behaviors>";

// The daemon may answer only at a later call, as it does on a machine that is loaded.
void learn(MaxAges& ages, const Entry& entry, MaxAge& age) {
  ages.add(entry, age);
  test::await([&] {
    ages.update();
    return age.is_known();
  });
}

class Arriving : public testing::Test {
 protected:
  explicit Arriving(const std::string& entries =
                        "<in topic='/nav' type='a/msg/B' "
                        "port='/Nav/cmd:o' max_size='64'/>")
      : read_(read_dds(entries)), entry_(read_.entry()), account_(entry_.outside(), "publisher") {}

  [[nodiscard]] bool is_active(const std::string& source) {
    return daemon_.source(source)["active"];
  }

  test::Daemon daemon_{kArrivals};
  Read read_;
  const Entry& entry_;
  Account account_;
  Node node_{"gateway"};
  Incoming incoming_{node_, entry_, account_};
};

TEST_F(Arriving, ASampleIsDeliveredByOneCopyAsTheTypeThatTheMappingNames) {
  auto in = node_.input_port("/Base/cmd:i", Type::variable("a/msg/B", 1));
  const BytesSample sample("hello");
  EXPECT_EQ(incoming_.deliver(sample, kNever), Fate::kPassed);
  EXPECT_EQ(sample.copied, 5u);
  auto taken = in.take();
  ASSERT_TRUE(taken);
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(taken->data()), taken->size()), "hello");
  EXPECT_EQ(account_.passed.value(), 1u);
  account_.look(1);
  EXPECT_THAT(account_.text(), testing::HasSubstr("has 5 bytes"));
}

TEST_F(Arriving, AComponentOfAnotherTypeIsRefused) {
  const auto in = node_.input_port("/Base/cmd:i", Type::variable("a/msg/C", 64));
  incoming_.deliver(BytesSample("hello"), kNever);
  EXPECT_THAT(daemon_.connection("/Nav/cmd:o", "/Base/cmd:i")["mismatch"].get<std::string>(),
              testing::HasSubstr("sends a/msg/B (of any size), the input port of \"gateway\" takes "
                                 "a/msg/C (of any size)"));
}

TEST_F(Arriving, ALateSampleIsNoArrival) {
  EXPECT_EQ(incoming_.deliver(BytesSample("hello"), kPassed), Fate::kLate);
  EXPECT_FALSE(is_active("/Nav/cmd:o"));
  EXPECT_EQ(account_.late.value(), 1u);
  EXPECT_EQ(daemon_.source("/Nav/cmd:o")["late"], 1);
}

TEST_F(Arriving, WhatDoesNotFitIsCountedAndPassedOver) {
  EXPECT_EQ(incoming_.deliver(BytesSample(std::string(65, 'x')), kNever), Fate::kTooLarge);
  EXPECT_EQ(incoming_.deliver(BytesSample(std::string(64, 'x')), kNever), Fate::kPassed);
  EXPECT_EQ(incoming_.deliver(BytesSample(""), kNever), Fate::kPassed);
  EXPECT_EQ(account_.too_large.value(), 1u);
}

// There is memory for one sample that is being written: another one did arrive all the same.
TEST_F(Arriving, ASampleForWhichThereIsNoMemoryIsAnArrivalUnlessItIsLate) {
  class Nested : public BytesSample {
   public:
    Nested(Incoming& incoming, Time deadline)
        : BytesSample("hello"), incoming_(incoming), deadline_(deadline) {}
    [[nodiscard]] bool copy(std::size_t /*from*/, WritableBytes /*to*/) const noexcept override {
      fate = incoming_.deliver(BytesSample("meanwhile"), deadline_);
      return false;
    }
    mutable Fate fate = Fate::kPassed;

   private:
    Incoming& incoming_;
    const Time deadline_;
  };
  const Nested late(incoming_, kPassed);
  incoming_.deliver(late, kNever);
  EXPECT_EQ(late.fate, Fate::kLate);
  EXPECT_FALSE(is_active("/Nav/cmd:o"));
  EXPECT_EQ(account_.late.value(), 1u);
  const Nested in_time(incoming_, kNever);
  incoming_.deliver(in_time, kNever);
  EXPECT_EQ(in_time.fate, Fate::kNoSlot);
  EXPECT_TRUE(is_active("/Nav/cmd:o"));
  EXPECT_EQ(account_.no_slot.value(), 1u);
  EXPECT_EQ(account_.passed.value(), 0u);
}

TEST(DoesNotFit, SaysBothSizes) {
  const Read variable = read_dds("<in topic='/a' type='a/msg/B' port='/a:o' max_size='1KiB'/>");
  EXPECT_EQ(does_not_fit(variable.entry(), 5012),
            "the last bad sample has 5012 bytes; max_size is 1024");
  const Read fixed =
      read_iceoryx("<in service='a' instance='b' event='c' port='/a:o' type='Speed' size='16'/>");
  EXPECT_EQ(does_not_fit(fixed.entry(), 1), "the last bad sample has 1 byte; Speed has 16");
}

// Until then it is not for ever either, but that is another thing to say.
TEST_F(Arriving, TIsKnownOnceTheDaemonLetsItBeObserved) {
  MaxAge age;
  EXPECT_FALSE(age.is_known());
  MaxAges nobodys("no-such-instance");
  nobodys.add(entry_, age);
  EXPECT_FALSE(age.is_known());
  MaxAges ages("");
  learn(ages, entry_, age);
  EXPECT_FALSE(age.is_forever());
}

TEST_F(Arriving, WhatCannotBeReadIsCountedAndPassedOver) {
  BytesSample broken("hello");
  broken.is_broken = true;
  EXPECT_EQ(incoming_.deliver(broken, kNever), Fate::kUnreadable);
  EXPECT_FALSE(is_active("/Nav/cmd:o"));
  EXPECT_EQ(account_.unreadable.value(), 1u);
  EXPECT_EQ(incoming_.deliver(BytesSample("hello"), kNever), Fate::kPassed);
}

TEST_F(Arriving, ASampleCostsNoAllocationOnceItsReceiversAreKnown) {
  const auto in = node_.input_port("/Base/cmd:i", Type::variable("a/msg/B", 1));
  const BytesSample sample("hello");
  incoming_.deliver(sample, kNever);
  const auto before = test::allocations_of_this_thread();
  for (int i = 0; i < 100; ++i) incoming_.deliver(sample, i % 2 == 0 ? kNever : kPassed);
  EXPECT_EQ(test::allocations_of_this_thread(), before);
}

class ArrivingBoolean : public Arriving {
 protected:
  ArrivingBoolean()
      : Arriving(
            "<in topic='/estop' type='std_msgs/msg/Bool' true='/pressed:o' "
            "false='/released:o'/>") {}
  Fate say(bool value, Time deadline = kNever) {
    return incoming_.deliver(BytesSample(std::string("\0\1\0\0", 4) + (value ? '\1' : '\0'), 4),
                             deadline);
  }
};

TEST_F(ArrivingBoolean, EachSampleIsPublishedAtItsOwnSourceAndEndsTheOther) {
  EXPECT_EQ(say(false), Fate::kPassed);
  EXPECT_TRUE(is_active("/released:o"));
  EXPECT_FALSE(is_active("/pressed:o"));
  EXPECT_EQ(say(true), Fate::kPassed);
  EXPECT_FALSE(is_active("/released:o"));
  EXPECT_TRUE(is_active("/pressed:o"));
  EXPECT_EQ(daemon_.source("/pressed:o")["published"], 1);
}

// What a gateway believed that was killed is not trusted.
TEST_F(ArrivingBoolean, TheFirstSampleEndsWhatAPredecessorBelieved) {
  {
    const Read others = read_dds(
        "<in topic='/e' type='std_msgs/msg/Bool' true='/other/pressed:o' "
        "false='/other/released:o'/>");
    Incoming predecessor(node_, others.entry(), account_);
    predecessor.deliver(BytesSample(std::string("\0\1\0\0\0", 5), 4), kNever);
  }
  ASSERT_TRUE(is_active("/other/released:o"));
  const Read same = read_dds(
      "<in topic='/e' type='std_msgs/msg/Bool' true='/other/pressed:o' "
      "false='/other/released:o'/>");
  Incoming successor(node_, same.entry(), account_);
  successor.deliver(BytesSample(std::string("\0\1\0\0\1", 5), 4), kNever);
  EXPECT_FALSE(is_active("/other/released:o"));
  EXPECT_TRUE(is_active("/other/pressed:o"));
}

TEST_F(ArrivingBoolean, WhatIsNoBooleanEndsBoth) {
  for (const std::string& bytes : {std::string("\0\1\0\0\2", 5), std::string("\0\1\0\0", 4),
                                   std::string("\0\1", 2), std::string()}) {
    say(true);
    EXPECT_EQ(incoming_.deliver(BytesSample(bytes, 4), kNever), Fate::kUnreadable);
    EXPECT_FALSE(is_active("/pressed:o")) << bytes.size();
    EXPECT_FALSE(is_active("/released:o")) << bytes.size();
  }
}

TEST_F(ArrivingBoolean, ASampleThatNobodyCanReadEndsBoth) {
  say(false);
  incoming_.fail();
  EXPECT_FALSE(is_active("/released:o"));
  EXPECT_EQ(account_.unreadable.value(), 1u);
}

// Its field can be read, and then its memory is gone.
TEST_F(ArrivingBoolean, ASampleThatIsReadInPartEndsBoth) {
  class ReadInPart : public BytesSample {
   public:
    using BytesSample::BytesSample;
    [[nodiscard]] bool copy(std::size_t from, WritableBytes to) const noexcept override {
      return to.size() == 1 && BytesSample::copy(from, to);
    }
  };
  say(true);
  EXPECT_EQ(incoming_.deliver(ReadInPart(std::string("\0\1\0\0\1", 5), 4), kNever),
            Fate::kUnreadable);
  EXPECT_FALSE(is_active("/pressed:o"));
  EXPECT_FALSE(is_active("/released:o"));
}

// What was said before a reader came may count only where nothing that it says ends by itself.
TEST_F(ArrivingBoolean, ATopicIsForEverIfBothItsSourcesAreAndItHasNoMaxAge) {
  const auto is_forever = [&](const std::string& pressed, const std::string& released,
                              const std::string& more) {
    daemon_.load("<behaviors><source port='/pressed:o' timeout='" + pressed +
                 "'/><source port='/released:o' timeout='" + released +
                 "'/><behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o</config>"
                 "<condition>not /pressed:o or /released:o</condition></behavior></behaviors>");
    const Read read = read_dds(
        "<in topic='/lock' type='std_msgs/msg/Bool' true='/pressed:o' false='/released:o' " + more +
        "/>");
    MaxAges ages("");
    MaxAge age;
    learn(ages, read.entry(), age);
    return age.is_forever();
  };
  EXPECT_TRUE(is_forever("forever", "forever", ""));
  EXPECT_FALSE(is_forever("forever", "1s", ""));
  EXPECT_FALSE(is_forever("1s", "forever", ""));
  EXPECT_FALSE(is_forever("forever", "forever", "max_age='1s'"));
}

TEST_F(ArrivingBoolean, ALateSampleMakesNothingActiveAndEndsTheOther) {
  say(false);
  EXPECT_EQ(say(true, kPassed), Fate::kLate);
  EXPECT_FALSE(is_active("/pressed:o"));
  EXPECT_FALSE(is_active("/released:o"));
}

// A lock that is pressed once, and holds until it is released: the T of the other source, which
// nobody reads, must not make its one press late.
TEST_F(ArrivingBoolean, ALatePressCountsAsLongAsItsOwnSourceAllows) {
  daemon_.load(
      "<behaviors timeout='500ms'><source port='/pressed:o' timeout='forever'/>"
      "<behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o</config>"
      "<condition>not /pressed:o</condition></behavior></behaviors>");
  Read lock = read_dds(
      "<in topic='/lock' type='std_msgs/msg/Bool' true='/pressed:o' false='/released:o' "
      "max_age='3600s'/>");
  MaxAges ages("");
  learn(ages, lock.entry(), incoming_.max_age());
  EXPECT_EQ(incoming_.max_age().get(), 500'000'000);
  const Time a_minute_ago =
      std::chrono::time_point_cast<Time::duration>(std::chrono::steady_clock::now()) -
      std::chrono::minutes(1);
  const Time deadline = a_minute_ago + std::chrono::milliseconds(500);
  EXPECT_EQ(say(true, deadline), Fate::kPassed);
  EXPECT_TRUE(is_active("/pressed:o"));
  EXPECT_EQ(say(false, deadline), Fate::kLate);
  EXPECT_FALSE(is_active("/pressed:o")) << "a deactivation is never late";
  EXPECT_FALSE(is_active("/released:o"));
}

// Of an entry with one of the two sources.
class ArrivingRelease : public Arriving {
 protected:
  ArrivingRelease()
      : Arriving("<in topic='/estop' type='std_msgs/msg/Bool' false='/released:o'/>") {}
  Fate say(char value, Time deadline = kNever) {
    return incoming_.deliver(BytesSample(std::string("\0\1\0\0", 4) + value, 4), deadline);
  }
};

TEST_F(ArrivingRelease, TheOtherValueOnlyEndsTheSourceThatThereIs) {
  EXPECT_EQ(say('\1'), Fate::kPassed);
  EXPECT_FALSE(is_active("/released:o"));
  EXPECT_EQ(say('\0'), Fate::kPassed);
  EXPECT_TRUE(is_active("/released:o"));
  EXPECT_EQ(say('\1', kPassed), Fate::kPassed) << "a deactivation is never late";
  EXPECT_FALSE(is_active("/released:o"));
  EXPECT_EQ(account_.passed.value(), 3u);
  EXPECT_EQ(daemon_.source("/released:o")["published"], 1);
}

TEST_F(ArrivingRelease, WhatIsNoBooleanEndsIt) {
  say('\0');
  EXPECT_EQ(say('\2'), Fate::kUnreadable);
  EXPECT_FALSE(is_active("/released:o"));
}

// Of the other one.
TEST_F(ArrivingRelease, WhatIsNoBooleanEndsAPressToo) {
  const Read press = read_dds("<in topic='/estop' type='std_msgs/msg/Bool' true='/pressed:o'/>");
  Incoming incoming(node_, press.entry(), account_);
  const auto say_here = [&](char value) {
    return incoming.deliver(BytesSample(std::string("\0\1\0\0", 4) + value, 4), kNever);
  };
  for (const char other : {'\2', '\0'}) {
    EXPECT_EQ(say_here('\1'), Fate::kPassed);
    EXPECT_TRUE(is_active("/pressed:o"));
    EXPECT_EQ(say_here(other), other == '\0' ? Fate::kPassed : Fate::kUnreadable);
    EXPECT_FALSE(is_active("/pressed:o"));
  }
}

TEST_F(ArrivingRelease, OfANumberBelowAThresholdToo) {
  const Read battery = read_dds(
      "<in topic='/battery' type='std_msgs/msg/Float32' below='/low:o' threshold='0.25' "
      "field='f32'/>");
  Incoming incoming(node_, battery.entry(), account_);
  const auto say = [&](float value) {
    return incoming.deliver(BytesSample(std::string("\0\1\0\0", 4) + bytes_of<float>(value), 4),
                            kNever);
  };
  EXPECT_EQ(say(0.25F), Fate::kPassed);
  EXPECT_TRUE(is_active("/low:o"));
  EXPECT_EQ(say(0.5F), Fate::kPassed);
  EXPECT_FALSE(is_active("/low:o"));
}

// Its field may be another's.
TEST_F(Arriving, ASampleOfAnotherSizeThanItsTypeChoosesNeitherSource) {
  const Read battery = read_iceoryx(
      "<in service='Battery' instance='Main' event='State' above='/pressed:o' below='/released:o' "
      "threshold='0' field='u8' type='State' size='8'/>");
  Account account(battery.entry().outside(), "publisher");
  Incoming incoming(node_, battery.entry(), account);
  for (const std::string& bytes : {std::string(9, '\1'), std::string(1, '\1')}) {
    EXPECT_EQ(incoming.deliver(BytesSample(std::string(8, '\1')), kNever), Fate::kPassed);
    EXPECT_TRUE(is_active("/pressed:o"));
    EXPECT_EQ(incoming.deliver(BytesSample(bytes), kNever), Fate::kTooLarge);
    EXPECT_FALSE(is_active("/pressed:o"));
    EXPECT_FALSE(is_active("/released:o"));
  }
  EXPECT_EQ(account.too_large.value(), 2u);
  EXPECT_EQ(account.passed.value(), 2u);
}

}  // namespace
}  // namespace arbiter::gateway
