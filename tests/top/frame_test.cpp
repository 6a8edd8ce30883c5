// What is made of status documents.
#include "top/frame.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include "tests/top/pictures.hpp"

namespace arbiter::top {
namespace {

wire::InputStatus open_input(const std::string& name, std::uint64_t taken) {
  wire::InputStatus input;
  input.name = name;
  input.arbitrated = true;
  input.open.emplace();
  input.open->component = {"arm", 42, 1000};
  input.open->taken = taken;
  input.connections.push_back({});
  input.connections[0].source = "/low:o";
  input.connections[0].depth = 4;
  return input;
}

wire::SourceStatus open_source(const std::string& name, std::uint64_t published) {
  wire::SourceStatus source;
  source.name = name;
  source.timeout = kSecond / 2;
  source.open.emplace();
  source.open->component = {"low", 43, 1000};
  source.open->published = published;
  return source;
}

StampedStatus status_of(std::uint64_t taken, std::uint64_t published, shm::Nanoseconds at) {
  StampedStatus result;
  result.at = at;
  result.status.inputs = {open_input("/p:i", taken)};
  result.status.sources = {open_source("/low:o", published)};
  return result;
}

TEST(TopCensus, CountsPerSecondBetweenTwoDocuments) {
  StampedStatus before = status_of(10, 100, 5 * kSecond);
  StampedStatus now = status_of(40, 160, 7 * kSecond);
  now.status.inputs[0].open->dropped = 2;
  now.status.inputs[0].open->overtaken = 4;
  now.status.inputs[0].connections[0].discarded = 8;
  now.status.inputs[0].connections[0].refused = 10;
  now.status.inputs[0].connections[0].waiting = 3;
  now.status.sources[0].open->signals = 6;
  const Census census = census_of(now, &before);
  const PortFact& port = census.ports.at(0);
  ASSERT_TRUE(port.rates);
  EXPECT_EQ(port.rates->taken, 15);
  EXPECT_EQ(port.rates->lost, 8);
  EXPECT_EQ(port.rates->discarded, 4);
  EXPECT_EQ(port.waiting, 3u);
  EXPECT_EQ(port.depth, 4u);
  EXPECT_EQ(port.component, "arm (pid 42)");
  const SourceFact& source = census.sources.at(0);
  ASSERT_TRUE(source.rates);
  EXPECT_EQ(source.rates->published, 30);
  EXPECT_EQ(source.rates->signals, 3);
  EXPECT_EQ(source.ports, std::vector<std::string>{"/p:i"});
}

TEST(TopCensus, KnowsFromWhichHostALinkHasASource) {
  StampedStatus now = status_of(10, 100, kSecond);
  const auto host = [&] { return census_of(now, nullptr).sources.at(0).host; };
  wire::OpenOutput& open = *now.status.sources[0].open;
  open.described = "host head";
  EXPECT_EQ(host(), "") << "any component may describe itself so";
  open.component.node = "arbiter-link";
  EXPECT_EQ(host(), "head");
  open.described = "host head, 3 lost";
  EXPECT_EQ(host(), "head");
  open.described.reset();
  EXPECT_EQ(host(), "?");
}

TEST(TopCensus, HasNoRatesFromOneDocument) {
  const Census census = census_of(status_of(10, 100, kSecond), nullptr);
  EXPECT_FALSE(census.ports.at(0).rates);
  EXPECT_FALSE(census.sources.at(0).rates);
}

TEST(TopCensus, HasNoRatesOfAPortThatWasOpenedAgain) {
  const StampedStatus before = status_of(10, 100, kSecond);
  const Census census = census_of(status_of(3, 7, 2 * kSecond), &before);
  EXPECT_FALSE(census.ports.at(0).rates);
  EXPECT_FALSE(census.sources.at(0).rates);
}

TEST(TopCensus, FindsPortsAndSourcesByName) {
  StampedStatus now = status_of(1, 1, kSecond);
  now.status.inputs.push_back(open_input("/a:i", 1));
  const Census census = census_of(now, nullptr);
  EXPECT_EQ(census.find_port("/a:i"), 0);
  EXPECT_EQ(census.find_port("/p:i"), 1);
  EXPECT_EQ(census.find_port("/b:i"), -1);
  EXPECT_EQ(census.find_source("/low:o"), 0);
}

TEST(TopCensus, KnowsSinceWhenOnlyOfTheFirstModel) {
  StampedStatus now = status_of(1, 1, 100 * kSecond);
  now.wall = std::chrono::system_clock::time_point(std::chrono::milliseconds(50'000));
  wire::PastModelStatus model;
  model.since_ms = 40'000;
  model.how = "start";
  now.status.history = {model};
  EXPECT_EQ(census_of(now, nullptr).first_model_since, 90 * kSecond);
  now.wall = {};  // the clock has been set
  EXPECT_EQ(census_of(now, nullptr).first_model_since, 100 * kSecond);
  for (const std::int64_t wall_ms : {0, 50'000, -50'000}) {
    now.wall = std::chrono::system_clock::time_point(std::chrono::milliseconds(wall_ms));
    now.status.history[0].since_ms = INT64_MAX;
    EXPECT_EQ(census_of(now, nullptr).first_model_since, 100 * kSecond);
    now.status.history[0].since_ms = INT64_MIN;
    EXPECT_EQ(census_of(now, nullptr).first_model_since,
              100 * kSecond - std::max(wall_ms, std::int64_t{0}) * 1'000'000);
  }
  model.how = "reload";
  now.status.history.insert(now.status.history.begin(), model);
  EXPECT_EQ(census_of(now, nullptr).first_model_since, 0);
}

}  // namespace
}  // namespace arbiter::top
