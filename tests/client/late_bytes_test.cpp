// A sample whose publisher takes it itself: its bytes are written only where others may read them.
#include <gtest/gtest.h>

#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

// /nav goes to /own and /other; where /stop commands, to /other alone.
constexpr const char* kNavModel = R"(
<behaviors timeout="1000s">
  <behavior name="Go"><config at="/own">/nav</config></behavior>
  <behavior name="Show"><config at="/other">/nav</config></behavior>
  <behavior name="Point"><config at="/pointer">/point</config></behavior>
  <behavior name="Stop"><config at="/own">/stop</config><inhibition>Go</inhibition></behavior>
</behaviors>)";

class LateBytes : public testing::Test {
 protected:
  // Lends memory with kOld in it, as a sample before may have left it, and says what is to be
  // there.
  Published publish(Time deadline = Time::max()) {
    auto loan = out_.loan(kNew.size());
    slot_ = {loan->data(), loan->size()};
    write(kOld);
    return out_.publish(std::move(*loan), deadline, own_, [&] {
      ++written_;
      write(kNew);
    });
  }
  void write(const std::string& bytes) { std::memcpy(slot_.data(), bytes.data(), bytes.size()); }
  static std::string text_of(Bytes bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  template <class Port>
  static std::string taken_from(Port& port) {
    const auto sample = port.take();
    return sample ? text_of(**sample) : "nothing";
  }

  const std::string kOld = "old bytes";
  const std::string kNew = "new bytes";
  Daemon daemon_{kNavModel};
  Node node_{"relay"};
  OutputPort<void> out_ = node_.output_port("/nav", OutputPortOptions{});
  InputPort<void> own_ = node_.input_port("/own");
  WritableBytes slot_;
  int written_ = 0;
};

TEST_F(LateBytes, AreNotWrittenForWhoHasThemAnyway) {
  const Published published = publish();
  EXPECT_EQ(published.outcome.delivered, 1U);
  EXPECT_EQ(written_, 0);
  const auto sample = own_.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->sequence(), published.sequence);
  EXPECT_EQ(text_of(**sample), kOld) << "nobody has written it";
}

TEST_F(LateBytes, MayBeWrittenUntilTheNextCall) {
  static_cast<void>(publish());
  write(kNew);
  EXPECT_EQ(taken_from(own_), kNew);
}

TEST_F(LateBytes, AreWrittenForAnotherPortThatIsHandedThem) {
  Node reader("reader");
  auto other = reader.input_port("/other");
  EXPECT_EQ(publish().outcome.delivered, 2U);
  EXPECT_EQ(written_, 1);
  EXPECT_EQ(taken_from(other), kNew);
  EXPECT_EQ(taken_from(own_), kNew);
}

// Nor for a port of the same component: its reader need not be the one that knows them.
TEST_F(LateBytes, AreWrittenForAnotherPortOfTheSameNode) {
  auto other = node_.input_port("/other");
  static_cast<void>(publish());
  EXPECT_EQ(written_, 1);
  EXPECT_EQ(taken_from(other), kNew);
}

TEST_F(LateBytes, AreWrittenForATap) {
  Node watcher("watcher");
  auto tap = watcher.tap("/nav");
  static_cast<void>(publish());
  EXPECT_EQ(written_, 1);
  std::string seen;
  while (auto event = tap.take()) {
    if (const auto bytes = event->sample()) seen = text_of(*bytes);
  }
  EXPECT_EQ(seen, kNew);
}

TEST_F(LateBytes, AreWrittenForNobodyWhereTheSampleLoses) {
  auto stop = node_.output_port("/stop", OutputPortOptions{});
  stop.signal();
  const Published published = publish();
  EXPECT_EQ(published.outcome.discarded, 1U);
  EXPECT_EQ(published.sequence, 0U);
  EXPECT_EQ(written_, 0);
  EXPECT_FALSE(own_.take());
}

TEST_F(LateBytes, AreWrittenForAnotherPortEvenWhereTheSampleLosesAtOnesOwn) {
  auto other = node_.input_port("/other");
  auto stop = node_.output_port("/stop", OutputPortOptions{});
  stop.signal();
  EXPECT_EQ(publish().outcome.delivered, 1U);
  EXPECT_EQ(written_, 1);
  EXPECT_EQ(taken_from(other), kNew);
}

TEST_F(LateBytes, AreNotWrittenOnceTheOtherPortHasGone) {
  std::optional<InputPort<void>> other = node_.input_port("/other");
  static_cast<void>(publish());
  EXPECT_EQ(written_, 1);
  other.reset();
  await([&] { return publish().outcome.delivered == 1; });  // it is known here
  written_ = 0;
  static_cast<void>(publish());
  EXPECT_EQ(written_, 0);
}

// Its number may be that of a port of this daemon, too.
TEST_F(LateBytes, AreWrittenForAPortOfAnotherNodeWhateverIsSaidOfIt) {
  Node reader("reader");
  auto pointer = reader.input_port("/pointer");
  auto point = node_.output_port("/point", OutputPortOptions{});
  auto loan = point.loan(kNew.size());
  slot_ = {loan->data(), loan->size()};
  write(kOld);
  const Published published =
      point.publish(std::move(*loan), Time::max(), pointer, [&] { write(kNew); });
  EXPECT_EQ(published.outcome.delivered, 1U);
  EXPECT_EQ(taken_from(pointer), kNew);
}

// It is published before the other port comes: which reads nothing of it.
TEST_F(LateBytes, AreNotSeenByAPortThatComesAfterwards) {
  static_cast<void>(publish());
  Node reader("reader");
  auto other = reader.input_port("/other");
  EXPECT_EQ(taken_from(other), "nothing");
  static_cast<void>(publish());
  EXPECT_EQ(taken_from(other), kNew);
}

TEST_F(LateBytes, OfASampleThatIsLateAreNotWritten) {
  const Published published = publish(Time::min());
  EXPECT_TRUE(published.outcome.late);
  EXPECT_EQ(published.sequence, 0U);
  EXPECT_EQ(written_, 0);
  EXPECT_FALSE(own_.winner()) << "it is no arrival";
  EXPECT_TRUE(out_.loan(1)) << "the loan is free again";
}

TEST_F(LateBytes, ALoanOfAnotherPortIsRefused) {
  auto stop = node_.output_port("/stop", OutputPortOptions{});
  auto loan = stop.loan(1);
  const auto nothing = [] {};
  EXPECT_THROW(static_cast<void>(out_.publish(std::move(*loan), Time::max(), own_, nothing)),
               std::invalid_argument);
}

}  // namespace
}  // namespace arbiter::test
