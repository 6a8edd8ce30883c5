// In which order the recorder passes on what its sources tell.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <semaphore>
#include <string>
#include <utility>
#include <vector>

#include "recorder/pipeline.hpp"
#include "recorder/recorder.hpp"

namespace arbiter::test {
namespace {

// Each source's records keep their order; what bears a later time than now waits for now only.
TEST(TimeOrder, HoldsNothingBackForAClockThatIsWrong) {
  recorder::TimeOrder order;
  const auto context = std::make_shared<evidence::SourceContext>();
  const auto add = [&](evidence::Nanoseconds time) {
    evidence::Arrival arrival;
    arrival.context = context;
    arrival.time = time;
    order.add(std::make_shared<const evidence::Record>(arrival), 100);
  };
  add(1'000'000);
  add(50);
  std::vector<evidence::Nanoseconds> times;
  order.take_before(
      101, [&](const evidence::RecordPtr& record) { times.push_back(evidence::time_of(*record)); });
  EXPECT_EQ(times, (std::vector<evidence::Nanoseconds>{1'000'000, 50}));
}

// It is of a later time: until then others may have changed what is decided.
TEST(TimeOrder, WhatStandsBehindAGapWaitsForItsTime) {
  recorder::TimeOrder order;
  const auto add = [&](auto record, const char* source, evidence::Nanoseconds time) {
    auto context = std::make_shared<evidence::SourceContext>();
    context->source = source;
    record.context = std::move(context);
    record.time = time;
    order.add(std::make_shared<const evidence::Record>(std::move(record)), 1000);
  };
  evidence::SourceState state;
  state.why = evidence::SourceState::Why::gap;
  state.lost = 3;
  state.seen = 150;
  add(evidence::Arrival{}, "/fast", 50);
  add(state, "/fast", 150);
  add(evidence::Arrival{}, "/slow", 100);
  add(evidence::Arrival{}, "/fast", 160);
  std::vector<evidence::Nanoseconds> times;
  const auto note = [&](const evidence::RecordPtr& record) {
    times.push_back(evidence::time_of(*record));
  };
  order.take_before(150, note);
  EXPECT_EQ(times, (std::vector<evidence::Nanoseconds>{50, 100}));
  order.take_before(1000, note);
  EXPECT_EQ(times, (std::vector<evidence::Nanoseconds>{50, 100, 150, 160}));
}

// The recorder was stopped: it looks at a page before the tap has reached the publisher.
TEST(TimeOrder, WhatAPageSaysStandsBehindWhatWasBefore) {
  recorder::TimeOrder order;
  auto context = std::make_shared<evidence::SourceContext>();
  context->source = "/fast";
  const auto add = [&](auto record, evidence::Nanoseconds time) {
    record.context = context;
    record.time = time;
    order.add(std::make_shared<const evidence::Record>(std::move(record)), 1000);
  };
  evidence::SourceState page;
  page.seen = 300;
  add(page, 0);
  evidence::SourceState gap;
  gap.why = evidence::SourceState::Why::gap;
  gap.seen = 200;
  add(gap, 200);
  add(evidence::Arrival{}, 250);
  add(evidence::Arrival{}, 350);
  std::vector<evidence::Nanoseconds> times;
  order.take_before(1000, [&](const evidence::RecordPtr& record) {
    times.push_back(evidence::time_of(*record));
  });
  EXPECT_EQ(times, (std::vector<evidence::Nanoseconds>{200, 250, 300, 350}));
}

// An operator has deactivated the source while nobody had it open: that is read later.
TEST(TimeOrder, ADeactivationByAnOperatorStandsAtItsTime) {
  for (const auto why : {evidence::SourceState::Why::page, evidence::SourceState::Why::joined}) {
    recorder::TimeOrder order;
    std::vector<std::string> sources;
    const auto add = [&](auto record, const char* source) {
      auto context = std::make_shared<evidence::SourceContext>();
      context->source = source;
      record.context = std::move(context);
      order.add(std::make_shared<const evidence::Record>(std::move(record)), 1000);
    };
    evidence::SourceState state;
    state.why = why;
    state.seen = 500;
    state.word = shm::deactivation(300);
    add(state, "/again");
    evidence::Arrival arrival;
    arrival.time = 200;
    add(arrival, "/other");
    arrival.time = 400;
    add(arrival, "/later");
    order.take_before(1000, [&](const evidence::RecordPtr& record) {
      sources.push_back(evidence::context_of(*record)->source);
    });
    EXPECT_EQ(sources, (std::vector<std::string>{"/other", "/again", "/later"}));
  }
}

// Names may come and go for as long as it is recorded.
TEST(TimeOrder, ForgetsSourcesThatTellNoMore) {
  recorder::TimeOrder order;
  std::size_t most = 0;
  std::size_t taken = 0;
  for (int i = 1; i <= 10'000; ++i) {
    auto context = std::make_shared<evidence::SourceContext>();
    context->source = "/passing" + std::to_string(i);
    evidence::Arrival arrival;
    arrival.context = std::move(context);
    arrival.time = i;
    order.add(std::make_shared<const evidence::Record>(std::move(arrival)), i);
    order.take_before(i, [&](const evidence::RecordPtr&) { ++taken; });
    most = std::max(most, order.sources());
  }
  EXPECT_EQ(taken, 9'999u);
  EXPECT_LT(most, 5'000u);
}

// Where records go, from the pipeline's thread.
class Kept : public recorder::Sink {
 public:
  void write(const recorder::RecordPtr& record) override {
    sources.push_back(evidence::context_of(*record)->source);
    written.release();
  }
  void tick(evidence::Nanoseconds, evidence::Nanoseconds) override {}
  void finish(evidence::Nanoseconds horizon) override { end = horizon; }

  std::vector<std::string> sources;
  evidence::Nanoseconds end = 0;
  std::counting_semaphore<> written{0};
};

class PipelineTest : public testing::Test {
 protected:
  void push(const char* source, evidence::Nanoseconds time, evidence::Nanoseconds horizon,
            std::size_t bytes = 0) {
    auto context = std::make_shared<evidence::SourceContext>();
    context->source = source;
    evidence::Arrival arrival;
    arrival.context = std::move(context);
    arrival.time = time;
    arrival.payload.emplace(bytes);
    recorder::Batch batch;
    batch.add(std::move(arrival));
    batch.horizon = horizon;
    queue_.push(std::move(batch));
  }

  recorder::RecordQueue queue_;
  Kept kept_;
  recorder::Pipeline pipeline_{queue_, kept_, [] {}};
};

// A component has just begun, or the recorder was stopped: its tap is behind the others.
TEST_F(PipelineTest, WhatIsToldLateStandsAtItsTime) {
  push("/early", 100, 50);
  push("/later", 300, 400);
  push("/late", 200, 500);
  queue_.close();
  pipeline_.finish();
  EXPECT_EQ(kept_.sources, (std::vector<std::string>{"/early", "/late", "/later"}));
  EXPECT_EQ(kept_.end, 500);
}

// Not for the 16 MiB of a large sample.
TEST_F(PipelineTest, NothingWaitsThatTakesMuchMemory) {
  push("/large", 100, 200, std::size_t{17} << 20);
  kept_.written.acquire();
  push("/late", 50, 300);
  queue_.close();
  pipeline_.finish();
  EXPECT_EQ(kept_.sources, (std::vector<std::string>{"/large", "/late"}));
}

// Names may come and go for as long as it is recorded.
TEST(CountedSources, AreCountedOnceAndUpToABound) {
  constexpr std::size_t kMost = recorder::CountedSources::kMost;
  recorder::CountedSources sources;
  for (std::size_t i = 0; i < kMost; ++i) {
    sources.note("/passing" + std::to_string(i));
    sources.note("/stays");
  }
  EXPECT_EQ(sources.count(), kMost + 1);
  sources.note("/one more");
  EXPECT_EQ(sources.count(), kMost + 1);
}

}  // namespace
}  // namespace arbiter::test
