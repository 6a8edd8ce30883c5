// What an input port has dropped and what was overtaken there, as a tap reads it from the port's
// counters.
#include "client/tap/takes.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <numeric>
#include <random>
#include <vector>

namespace arbiter::test {
namespace {

using detail::TakeWatch;

// An input port that counts as an honest one does.
struct Port {
  std::unique_ptr<shm::InputSegment> segment = std::make_unique<shm::InputSegment>();

  shm::InputCounters& counters() const { return segment->header.counters; }
  shm::Lane& lane(std::size_t index) const { return segment->lanes[index]; }
  static void add(shm::Atomic<std::uint64_t>& counter, std::uint64_t count) {
    counter.store(counter.load() + count);
  }
  void give_lane(std::size_t index, shm::PortInstance publisher, shm::SourceId source) const {
    shm::Lane& lane = segment->lanes[index];
    lane.source.store(source);
    lane.link.store(publisher);
    for (auto* counter : {&lane.consumed, &lane.dropped, &lane.overtaken}) counter->store(0);
    lane.publisher.store(publisher);
  }
  void drop(std::size_t index) const {
    add(lane(index).dropped, 1);
    add(counters().dropped, 1);
    add(lane(index).consumed, 1);
  }
  void overtake(std::size_t index, std::uint64_t count) const {
    add(lane(index).overtaken, count);
    add(counters().overtaken, count);
    add(lane(index).consumed, count);
  }
};

std::vector<TakeWatch::News> look(TakeWatch& watch, bool is_last = false) {
  std::vector<TakeWatch::News> news;
  watch.look(is_last, news);
  return news;
}

TEST(Takes, AreToldOfEachSourceFromWhenTheyAreWatched) {
  const Port port;
  port.give_lane(3, 21, 7);
  port.drop(3);
  TakeWatch watch(*port.segment);
  EXPECT_TRUE(look(watch).empty());
  port.drop(3);
  port.overtake(3, 4);
  const auto news = look(watch);
  ASSERT_EQ(news.size(), 2u);
  EXPECT_FALSE(news[0].is_overtaken);
  EXPECT_EQ(news[0].count, 1u);
  EXPECT_EQ(news[0].source, 7u);
  EXPECT_EQ(news[0].sequence, 6u);
  EXPECT_TRUE(news[1].is_overtaken);
  EXPECT_EQ(news[1].count, 4u);
  EXPECT_TRUE(look(watch).empty());
}

TEST(Takes, ThatNoLaneCountsAreToldWithoutASource) {
  const Port port;
  TakeWatch watch(*port.segment);
  Port::add(port.counters().overtaken, 5);
  EXPECT_TRUE(look(watch).empty()) << "a lane may still be about to say whose they were";
  const auto news = look(watch);
  ASSERT_EQ(news.size(), 1u);
  EXPECT_EQ(news[0].count, 5u);
  EXPECT_EQ(news[0].source, shm::kNone);
  EXPECT_TRUE(look(watch).empty());
  Port::add(port.counters().dropped, 2);
  EXPECT_EQ(look(watch, true).size(), 1u) << "nothing comes any more";
}

// What is told adds up to the port's own counters, whatever lanes come and go, and whenever it is
// looked: between any two stores of the port.
TEST(Takes, AddUpToThePortsOwnCounters) {
  std::mt19937 random(5);
  for (int round = 0; round < 50; ++round) {
    const Port port;
    TakeWatch watch(*port.segment);
    std::vector<TakeWatch::News> news;
    const auto maybe_look = [&] {
      if (random() % 4 == 0) watch.look(false, news);
    };
    shm::PortInstance last = 0;
    for (int step = 0; step < 500; ++step) {
      const std::size_t index = random() % 4;
      shm::Lane& lane = port.lane(index);
      if (lane.publisher.load() == 0) {
        port.give_lane(index, ++last, static_cast<shm::SourceId>(index));
      } else if (random() % 8 == 0) {
        Port::add(port.counters().overtaken, random() % 3);  // what was left behind
        maybe_look();
        lane.publisher.store(0);
      } else {
        const bool is_overtaken = random() % 2 == 0;
        const std::uint64_t count = is_overtaken ? 1 + random() % 5 : 1;
        Port::add(is_overtaken ? lane.overtaken : lane.dropped, count);
        maybe_look();
        Port::add(is_overtaken ? port.counters().overtaken : port.counters().dropped, count);
      }
      maybe_look();
    }
    watch.look(true, news);
    std::uint64_t told[2] = {};
    for (const TakeWatch::News& each : news) told[each.is_overtaken ? 1 : 0] += each.count;
    EXPECT_EQ(told[0], port.counters().dropped.load());
    EXPECT_EQ(told[1], port.counters().overtaken.load());
  }
}

TEST(Takes, OfAPortThatLiesAreBoundedAndEnd) {
  std::mt19937_64 random(6);
  const Port port;
  TakeWatch watch(*port.segment);
  for (int round = 0; round < 2000; ++round) {
    for (auto& lane : port.segment->lanes) {
      if (random() % 16 != 0) continue;
      for (auto* word : {&lane.publisher, &lane.link, &lane.dropped, &lane.overtaken}) {
        word->store(random() >> random() % 64);
      }
    }
    port.counters().dropped.store(random() >> random() % 64);
    port.counters().overtaken.store(random() >> random() % 64);
    EXPECT_LE(look(watch, round % 7 == 0).size(), 2 * std::size_t{shm::kMaxLanes} + 2);
  }
}

}  // namespace
}  // namespace arbiter::test
