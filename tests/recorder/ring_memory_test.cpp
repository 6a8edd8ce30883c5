// What a flight recorder keeps where its memory is full.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "tests/recorder/fed_ring.hpp"

namespace arbiter::test {
namespace {

using evidence::Missed;
using testing::SizeIs;
using Why = Missed::Why;

class RingMemory : public RingTest {
 protected:
  // Of the last file, with payloads.
  template <class Kind>
  [[nodiscard]] std::vector<Kind> written() const {
    std::vector<Kind> all;
    evidence::read_recording(written_.back(), evidence::Payloads::read,
                             [&](evidence::Record&& record) {
                               if (auto* one = std::get_if<Kind>(&record)) all.push_back(*one);
                             });
    return all;
  }
  void arrive(const std::string& source, std::size_t payload = 0) {
    time_ += 10;
    incident_.arrive(source, time_, time_ + 1, Incident::Fate::accepted);
    if (payload != 0) incident_.put_payload(payload);
  }

  static constexpr std::size_t kMemory = 64 << 10;
  Incident incident_;
  evidence::Nanoseconds time_ = 2000;
  recorder::Ring ring_{options(kSecond, kMemory)};
};

TEST_F(RingMemory, PayloadsGiveWayBeforeWhoCommanded) {
  for (int i = 0; i < 50; ++i) arrive("/high");
  for (int i = 0; i < 6; ++i) arrive("/low", 12 << 10);
  const auto recorded = dump(ring_, incident_);
  EXPECT_LE(ring_.bytes(), kMemory);
  EXPECT_THAT(recorded.runs.at(0).decisions, SizeIs(56));
  EXPECT_EQ(recorded.runs[0].lost_samples, 3u);
  std::vector<bool> has_payload;
  for (const auto& each : written<evidence::Arrival>()) {
    if (each.context->source == "/low") has_payload.push_back(each.payload.has_value());
  }
  EXPECT_EQ(has_payload, (std::vector<bool>{false, false, false, true, true, true}));
  const auto missed = written<Missed>();
  ASSERT_THAT(missed, SizeIs(1)) << "told once for each source";
  EXPECT_EQ(missed[0].why, Why::memory);
  EXPECT_EQ(missed[0].source, "/low");
  EXPECT_EQ(missed[0].samples, 3u);
  EXPECT_EQ(missed[0].from, time_ - 50);
  EXPECT_EQ(missed[0].to, time_ - 30);
}

TEST_F(RingMemory, SourcesThatHaveComeAndGoneAreNotSummedUpForEver) {
  constexpr std::size_t kMore = 1000;
  arrive("/first");
  for (std::size_t i = 0; i < shm::kMaxSources + kMore; ++i) arrive("/" + std::to_string(i));
  dump(ring_, incident_);
  const auto states = written<evidence::SourceState>();
  EXPECT_LE(states.size(), 2 * kMore);
}

// What is left of it in the memory is all but its payload.
TEST_F(RingMemory, ASampleThatIsLargerThanTheMemoryDrivesOutNothing) {
  for (int i = 0; i < 50; ++i) arrive("/high");
  arrive("/low", 100);
  arrive("/low", 70 << 10);
  evidence::Arrival large = std::get<evidence::Arrival>(incident_.records().back());
  large.time = large.seen = time_ + 10;
  large.generation = 3;
  large.masks = {};
  large.masks.blind = 1;
  large.origin = {5, 6};
  incident_.add(large);
  const auto recorded = dump(ring_, incident_);
  EXPECT_THAT(recorded.runs.at(0).decisions, SizeIs(53));
  EXPECT_EQ(recorded.runs[0].lost_samples, 2u);
  const auto arrivals = written<evidence::Arrival>();
  EXPECT_TRUE(arrivals.at(50).payload) << "the others' payloads stay";
  const evidence::Arrival& kept = arrivals.back();
  EXPECT_FALSE(kept.has_payload);
  EXPECT_EQ(kept.context->source, "/low");
  EXPECT_EQ(kept.time, large.time);
  EXPECT_EQ(kept.seen, large.seen);
  EXPECT_TRUE(kept.is_sample);
  EXPECT_EQ(kept.sequence, large.sequence);
  EXPECT_EQ(kept.size, std::uint64_t{70} << 10);
  EXPECT_EQ(kept.generation, large.generation);
  EXPECT_EQ(kept.word, large.word);
  EXPECT_EQ(kept.masks.blind, 1u);
  EXPECT_EQ(kept.masks.accepted, 0u);
  EXPECT_EQ(kept.origin.publisher, 5u);
  EXPECT_EQ(kept.origin.sequence, 6u);
}

// They take less than what is known of their arrivals.
TEST_F(RingMemory, SmallPayloadsLeaveWithTheirArrivals) {
  for (int i = 0; i < 2000; ++i) arrive("/low", 8);
  const auto recorded = dump(ring_, incident_);
  EXPECT_LE(ring_.bytes(), kMemory);
  EXPECT_GT(recorded.runs.at(0).decisions.size(), 50u);
  EXPECT_EQ(recorded.runs[0].lost_samples, 0u);
  for (const auto& each : written<evidence::Arrival>()) EXPECT_TRUE(each.payload);
}

// Neither drives out the other.
TEST_F(RingMemory, PayloadsAndRecordsShareTheMemory) {
  for (int i = 0; i < 2000; ++i) arrive("/low", 1000);
  const auto recorded = dump(ring_, incident_);
  EXPECT_LE(ring_.bytes(), kMemory);
  std::size_t payloads = 0;
  std::size_t last = 0;  // that lacks one
  const auto arrivals = written<evidence::Arrival>();
  for (std::size_t i = 0; i < arrivals.size(); ++i) {
    payloads += arrivals[i].payload ? 1 : 0;
    if (!arrivals[i].payload) last = i;
  }
  EXPECT_EQ(payloads, kMemory / 2 / 1000);
  EXPECT_GT(arrivals.size(), 2 * payloads);
  EXPECT_EQ(arrivals.size() - last - 1, payloads) << "the newest are kept";
  EXPECT_EQ(recorded.runs.at(0).lost_samples, arrivals.size() - payloads);
}

TEST_F(RingMemory, SaysOfWhichSourcesNothingIsRecorded) {
  using State = evidence::SourceState;
  for (const auto why : {Why::refused, Why::stranger}) {
    incident_.add(Missed{"/low", 1001, 1001, 0, 0, why, "still"});
    incident_.add(Missed{"/high", 1001, 1001, 0, 0, why, "no more"});
  }
  incident_.state("/high", 1002, 1002, shm::kNeverActive, State::Why::joined);
  for (int i = 0; i < 1000; ++i) arrive("/high");
  dump(ring_, incident_);
  const auto missed = written<Missed>();
  ASSERT_THAT(missed, SizeIs(2));
  EXPECT_EQ(missed[0].why, Why::refused);
  EXPECT_EQ(missed[1].why, Why::stranger);
  for (const Missed& each : missed) EXPECT_EQ(each.text, "still");
}

}  // namespace
}  // namespace arbiter::test
