// In which order the recorder passes on what its sources tell.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "recorder/pipeline.hpp"

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

}  // namespace
}  // namespace arbiter::test
