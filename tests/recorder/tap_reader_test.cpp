// One source, read while little or much waits for the writer.
#include "recorder/tap_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "shm/clock.hpp"
#include "tests/recorder/recording.hpp"

namespace arbiter::test {
namespace {

using evidence::Missed;
using recorder::Backlog;
using recorder::TapReader;

struct Large {
  std::array<char, 64 << 10> bytes;
};

class ReadSource : public testing::Test {
 protected:
  TapReader reader(std::size_t most_payload = recording::kMaxMessageBytes) {
    TapOptions options;
    options.may_wait = false;
    options.max_held = 1;
    return {node_.tap("/low", options), true, shm::kNeverActive, most_payload};
  }
  void poll(TapReader& reader, Backlog& backlog) {
    std::vector<evidence::RecordPtr> records;
    reader.poll(backlog, records);
    for (const auto& record : records) {
      if (const auto* missed = std::get_if<Missed>(&*record)) missed_.push_back(*missed);
      const auto* arrival = std::get_if<evidence::Arrival>(&*record);
      if (arrival == nullptr) continue;
      ++arrivals_;
      payloads_ += arrival->payload ? 1 : 0;
    }
  }

  Daemon daemon_{kLasting};
  Node node_{"test"};
  OutputPort<Large> low_ = node_.output_port<Large>("/low");
  const std::unique_ptr<Large> sample_ = std::make_unique<Large>();
  std::vector<Missed> missed_;
  std::size_t arrivals_ = 0;
  std::size_t payloads_ = 0;
};

// Else the file could not be written: neither this one nor, of a flight recorder, any other.
TEST_F(ReadSource, LeavesOutAPayloadThatNoReaderIsReadyFor) {
  TapReader all = reader(sizeof(Large));
  TapReader none = reader(sizeof(Large) - 1);
  low_.publish(*sample_);
  Backlog backlog{{}, std::size_t{64} << 20};
  poll(all, backlog);
  EXPECT_EQ(payloads_, 1u);
  EXPECT_TRUE(missed_.empty());
  poll(none, backlog);
  EXPECT_EQ(arrivals_, 2u);
  EXPECT_EQ(payloads_, 1u);
  ASSERT_EQ(missed_.size(), 1u);
  EXPECT_EQ(missed_[0].why, Missed::Why::too_large);
  EXPECT_EQ(missed_[0].samples, 1u);
}

// As its successor's may be, which has another version of the type.
TEST(ReadSources, HaveTheAlignmentOfTheOneThatHasThemOpen) {
  const Daemon daemon(kLasting);
  Node node("test");
  TapOptions options;
  options.may_wait = false;
  TapReader reader(node.tap("/low", options), false, shm::kNeverActive);
  for (const std::size_t alignment : {8u, 4u}) {
    auto port = node.output_port("/low", Type("t", 8, alignment));
    const evidence::SourceContext* context = nullptr;
    std::vector<evidence::RecordPtr> records;
    Backlog backlog{{}, std::size_t{64} << 20};
    while (context == nullptr) {
      port.signal();
      reader.poll(backlog, records);
      for (const auto& record : records) {
        if (std::holds_alternative<evidence::Arrival>(*record)) {
          context = evidence::context_of(*record);
        }
      }
    }
    EXPECT_EQ(context->alignment, alignment);
  }
}

// In one round: nobody knows of the next.
TEST_F(ReadSource, LeavesOutPayloadsOnceMuchHasBeenRead) {
  TapReader source = reader();
  constexpr std::size_t kSamples = 20;
  for (std::size_t i = 0; i < kSamples; ++i) low_.publish(*sample_);
  Backlog backlog{{}, 10 * sizeof(Large)};
  poll(source, backlog);
  EXPECT_LE(backlog.waiting.all(), backlog.most);
  EXPECT_LE(payloads_ * sizeof(Large), backlog.most);
  EXPECT_GE(payloads_, 7u);
  EXPECT_EQ(arrivals_, kSamples);
  EXPECT_EQ(missed_.size(), kSamples - payloads_);
  for (const Missed& each : missed_) {
    EXPECT_EQ(each.why, Missed::Why::queue);
    EXPECT_EQ(each.events, 0u);
  }
}

// And then the events of others are not left out for it.
TEST_F(ReadSource, TakesOneLargePayloadWhereLittleWaits) {
  TapReader source = reader();
  for (int i = 0; i < 5; ++i) low_.publish(*sample_);
  Backlog backlog{{}, sizeof(Large) / 4};
  poll(source, backlog);
  EXPECT_EQ(arrivals_, 5u);
  EXPECT_EQ(payloads_, 1u);
  EXPECT_EQ(missed_.size(), 4u);
  for (const Missed& each : missed_) EXPECT_EQ(each.events, 0u);
}

// From the last that was told on, anything may have happened.
TEST_F(ReadSource, SaysSinceWhenEventsAreMissing) {
  TapReader source = reader();
  Backlog backlog{{}, std::size_t{64} << 20};
  const shm::Nanoseconds before = shm::monotonic_now();
  low_.signal();
  poll(source, backlog);
  const shm::Nanoseconds between = shm::monotonic_now();
  for (int i = 0; i < 3000; ++i) low_.signal();
  poll(source, backlog);
  ASSERT_EQ(missed_.size(), 1u);
  EXPECT_EQ(missed_[0].why, Missed::Why::overtaken);
  EXPECT_GE(missed_[0].from, before);
  EXPECT_LE(missed_[0].from, between);
  EXPECT_GT(missed_[0].to, between);
}

}  // namespace
}  // namespace arbiter::test
