// The status document: what it says of ports and connections.
#include <gtest/gtest.h>

#include <random>

#include <arbiter/arbiter.hpp>

#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

const std::string kLowHighAndStop =
    "<behaviors timeout='forever'><arbiter at='/in'>"
    "<select from='/low'>not /high and not /stop</select><select from='/high'/>"
    "</arbiter></behaviors>";

TEST(Status, TellsWhatAModelNamesThoughNobodyIsThere) {
  Daemon daemon(kLowHighAndStop);
  const auto status = daemon.status();
  EXPECT_EQ(status["instance"], "test");
  EXPECT_EQ(status["pid"], daemon.process().pid());
  EXPECT_EQ(status["model"]["generation"], 1);
  EXPECT_EQ(status["sources"].size(), 3u);
  ASSERT_EQ(status["inputs"].size(), 1u);
  const auto in = status["inputs"][0];
  EXPECT_EQ(in["open"], false);
  EXPECT_EQ(in["idle"], true);
  EXPECT_EQ(in["winner"], nullptr);
  EXPECT_EQ(in["connections"].size(), 2u);
  EXPECT_EQ(in["connections"][0]["state"], "neither end open");
  ASSERT_EQ(in["senses"].size(), 1u);
  EXPECT_EQ(in["senses"][0]["source"], "/stop");
}

// `s and not a and not b and not c` for each of 60 connections, with conflict="first"; but /s20 and
// /s40 do without.
std::string entangled_model() {
  constexpr unsigned kConnections = 60;
  std::mt19937 random(1);
  const auto other = [&] { return "not /s" + std::to_string(random() % kConnections); };
  std::string model = "<behaviors timeout='forever'><arbiter at='/in' conflict='first'>";
  for (unsigned i = 0; i < kConnections; ++i) {
    const std::string own = "/s" + std::to_string(i);
    const std::string condition = other() + " and " + other() + " and " + other();
    model += "<select from='" + own + "'>" + (i == 20 || i == 40 ? "" : condition) + "</select>";
  }
  return model + "</arbiter><arbiter at='/other'><select from='/s1'/></arbiter></behaviors>";
}

TEST(Status, TellsWhereRulesAreTriedInOrderAndTheFirstOfThemWins) {
  Daemon daemon(entangled_model());
  EXPECT_EQ(daemon.input("/in")["in_order"], true);
  EXPECT_EQ(daemon.input("/other")["in_order"], false);
  Node node("test");
  auto in = node.input_port<int>("/in");
  auto earlier = node.output_port<int>("/s20");
  auto later = node.output_port<int>("/s40");
  EXPECT_EQ(later.publish(1).delivered, 1u);
  EXPECT_EQ(daemon.input("/in")["winner"], "/s40");
  EXPECT_EQ(earlier.publish(2).delivered, 1u);
  EXPECT_EQ(later.publish(3).discarded, 1u);
  EXPECT_EQ(daemon.input("/in")["winner"], "/s20");
  const auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ(**sample, 2);
  EXPECT_FALSE(in.take());
}

TEST(Status, TellsWhichEndIsMissing) {
  Daemon daemon(kLowHighAndStop);
  Node node("test");
  {
    auto low = node.output_port<int>("/low");
    EXPECT_EQ(daemon.connection("/low", "/in")["state"], "input port not open");
    auto in = node.input_port<int>("/in");
    EXPECT_EQ(daemon.connection("/low", "/in")["state"], "connected");
  }
  auto in = node.input_port<int>("/in");
  EXPECT_EQ(daemon.connection("/low", "/in")["state"], "output port not open");
}

TEST(Status, TellsWhoWinsAndWhoIsActive) {
  Daemon daemon(kLowHighAndStop);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  auto in = node.input_port<int>("/in");
  low.signal();
  EXPECT_EQ(daemon.input("/in")["winner"], "/low");
  EXPECT_EQ(daemon.connection("/low", "/in")["winner"], true);
  high.signal();
  EXPECT_EQ(daemon.input("/in")["winner"], "/high");
  EXPECT_EQ(daemon.connection("/low", "/in")["winner"], false);
  EXPECT_EQ(daemon.connection("/low", "/in")["active"], true);
  EXPECT_EQ(daemon.source("/high")["active"], true);
}

TEST(Status, TellsWhoHasAPortAndWhatItCarries) {
  Daemon daemon(kLowHighAndStop);
  Node node("the-node");
  auto low = node.output_port<double>("/low");
  auto in = node.input_port("/in", {.depth = 5, .when_full = refuse_new, .keep = true});
  const auto source = daemon.source("/low");
  EXPECT_EQ(source["component"]["node"], "the-node");
  EXPECT_EQ(source["component"]["pid"], ::getpid());
  EXPECT_EQ(source["type"]["name"], "double");
  EXPECT_EQ(source["type"]["size"], 8);
  const auto input = daemon.input("/in");
  EXPECT_EQ(input["type"], nullptr);
  EXPECT_EQ(input["depth"], 5);
  EXPECT_EQ(input["keep"], true);
  EXPECT_EQ(input["when_full"], "refuse_new");
}

TEST(Status, CountsWhatBecomesOfSamples) {
  Daemon daemon(kLowHighAndStop);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  auto in = node.input_port<int>("/in", {.depth = 2});
  for (int i = 0; i < 5; ++i) low.publish(i);
  EXPECT_TRUE(in.take());
  high.signal();
  low.publish(6);
  EXPECT_FALSE(in.take());
  const auto source = daemon.source("/low");
  EXPECT_EQ(source["published"], 6);
  EXPECT_EQ(source["delivered"], 5);
  EXPECT_EQ(source["discarded"], 1);
  EXPECT_EQ(daemon.source("/high")["signals"], 1);
  const auto connection = daemon.connection("/low", "/in");
  EXPECT_EQ(connection["accepted"], 5);
  EXPECT_EQ(connection["overtaken"], 3);
  EXPECT_EQ(connection["taken"], 1);
  EXPECT_EQ(connection["dropped"], 1);
  EXPECT_EQ(connection["discarded"], 1);
  EXPECT_EQ(connection["waiting"], 0);
}

}  // namespace
}  // namespace arbiter::test
