// A daemon dies, or is stopped, and another takes over: components notice nothing.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "service/kept/descriptor_store.hpp"
#include "shm/segment.hpp"
#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

constexpr auto kForEver = std::chrono::hours::max();

TEST(Takeover, WhatIsOpenStaysOpenAndObeysTheNewModel) {
  Daemon daemon(only("a"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto b = node.output_port<Number>("/b");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(a.publish(Number{1}).delivered, 1u);
  daemon.kill();
  EXPECT_EQ(a.publish(Number{2}).delivered, 1u);
  daemon.write_model(only("b"));
  daemon.restart();
  EXPECT_EQ(daemon.status()["model"]["generation"], 2);
  EXPECT_EQ(daemon.connection("/b", "/in")["state"], "connected");
  EXPECT_FALSE(in.take()) << "both are of /a, which is no longer selected";
  EXPECT_EQ(a.publish(Number{3}).delivered, 0u);
  EXPECT_EQ(b.publish(Number{4}).delivered, 1u);
  EXPECT_EQ(take_from(in), 4);
}

TEST(Takeover, OfAConnectionThatStaysKeepsItsQueueAndItsCounts) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  for (int i = 1; i <= 3; ++i) out.publish(Number{i});
  EXPECT_EQ(take_from(in), 1);
  for (const bool is_killed : {true, false}) {
    is_killed ? daemon.kill() : void(daemon.terminate());
    daemon.restart();
    const auto connection = daemon.connection("/out", "/in");
    EXPECT_EQ(connection["accepted"], 3);
    EXPECT_EQ(connection["taken"], 1);
    EXPECT_EQ(connection["waiting"], 2);
  }
  EXPECT_EQ(take_from(in), 2);
  EXPECT_EQ(take_from(in), 3);
  EXPECT_FALSE(in.take());
}

TEST(Takeover, UnderLoadLosesAndDelaysNothing) {
  Daemon daemon(single_model());
  Component sender("sender");
  Node node("test");
  auto in = node.input_port<Number>("/in", {.depth = 1024, .when_full = refuse_new});
  ASSERT_EQ(sender.tell("output /out"), "open");
  std::atomic<bool> stop{false};
  std::int64_t next = 0;
  std::thread receiver([&] {
    while (!stop || next == 0) {
      const auto result = in.wait_for(kForEver);
      if (!result) continue;
      const std::int64_t value = (**result).value;
      if (value < 0) return;
      // Refused ones are missing; nothing comes twice, or late.
      EXPECT_GE(value, next);
      next = value + 1;
    }
  });
  sender.begin("publish /out 0 3000000");
  for (int i = 0; i < 8; ++i) {
    daemon.kill();
    daemon.restart();
    await([&] { return daemon.connection("/out", "/in")["state"] == "connected"; });
  }
  EXPECT_NE(sender.answer(), "dead");
  const auto source = daemon.source("/out");
  EXPECT_EQ(source["published"], 3000000);
  const std::uint64_t delivered = source["delivered"];
  const std::uint64_t refused = source["refused"];
  EXPECT_EQ(delivered + refused, 3000000u);
  for (int tries = 0; tries < 100000 && sender.tell("publish /out -1") != "1 0 0"; ++tries) {
  }
  receiver.join();
  const auto connection = daemon.connection("/out", "/in");
  EXPECT_EQ(connection["taken"], connection["accepted"]);
}

TEST(Takeover, KeepsActivityThatNobodyRenews) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  {
    Component other("other");
    ASSERT_EQ(other.tell("output /stop"), "open");
    other.tell("signal /stop");
    other.kill();
  }
  for (int i = 0; i < 3; ++i) {
    daemon.kill();
    daemon.restart();
    EXPECT_TRUE(daemon.source("/stop")["active"]);
    EXPECT_EQ(low.publish(Number{1}).delivered, 0u);
  }
  auto stop = node.output_port<Number>("/stop");
  stop.deactivate();
  EXPECT_EQ(low.publish(Number{2}).delivered, 1u);
  EXPECT_EQ(take_from(in), 2);
}

TEST(Takeover, FreesWhatDiedMeanwhileAndCarriesOnWithASuccessor) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  EXPECT_EQ(sender.tell("publish /out 1"), "1 0 0");
  daemon.kill();
  EXPECT_EQ(sender.tell("publish /out 2"), "1 0 0");
  sender.kill();
  daemon.restart();
  auto successor = node.output_port<Number>("/out");
  EXPECT_EQ(successor.publish(Number{3}).delivered, 1u);
  for (int i = 1; i <= 3; ++i) EXPECT_EQ(take_from(in), i);
}

TEST(Takeover, ADeathAfterwardsIsNoticed) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out", {.max_memory = 5 * 64});
  {
    Component receiver("receiver");
    ASSERT_EQ(receiver.tell("input /in 1 1 0"), "open");
    out.publish(Number{1});
    EXPECT_EQ(receiver.tell("hold /in"), "1");
    daemon.kill();
    daemon.restart();
    await([&] { return daemon.input("/in")["open"] == true; });
    for (int i = 2; i < 20; ++i) EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
    EXPECT_EQ(receiver.tell("held /in"), "1");
  }
  // Its slots come back, or there would be no room.
  for (int i = 0; i < 3; ++i) {
    auto in = node.input_port<Number>("/in", {.depth = 1});
    EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
    EXPECT_EQ(take_from(in), i);
  }
}

TEST(Takeover, WhatClosedMeanwhileIsClosed) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  {
    auto out = node.output_port<Number>("/out");
    daemon.kill();
  }
  daemon.restart();
  EXPECT_FALSE(daemon.source("/out")["open"]);
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
}

// Then it comes back without anything, and is not what it was.
TEST(Takeover, WhatClosedMeanwhileIsClosedThoughItWasAllThereWas) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  daemon.kill();
  ASSERT_EQ(sender.tell("close /out"), "closed");
  daemon.restart();
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
  EXPECT_EQ(sender.tell("output /other"), "open");
}

TEST(Takeover, WithoutAModelKeepsTheOneInForce) {
  Daemon daemon(only("a"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto in = node.input_port<Number>("/in");
  daemon.kill();
  daemon.restart_without_model();
  EXPECT_EQ(daemon.generation(), 1u);
  EXPECT_TRUE(daemon.input("/in")["arbitrated"]);
  EXPECT_EQ(a.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

// Nobody has the page of a source that nobody has open; the table names it by its id all the same.
TEST(Takeover, WithoutAModelTheOneInForceGoesOnForThoseWhoComeLater) {
  Daemon daemon(
      "<behaviors><behavior name='A'><config at='/in'>/a</config></behavior>"
      "<behavior name='B'><config at='/other'>/b</config><condition>not /c</condition>"
      "</behavior></behaviors>");
  Node node("test");
  auto a = node.output_port<Number>("/a");
  daemon.kill();
  daemon.restart_without_model();
  auto other = node.input_port<Number>("/other");
  auto b = node.output_port<Number>("/b");
  EXPECT_EQ(b.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(other), 1);
  node.output_port<Number>("/c").signal();
  EXPECT_EQ(b.publish(Number{2}).delivered, 0u);
}

TEST(Takeover, ABadModelOfTheNewDaemonHarmsNobody) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  daemon.kill();
  daemon.write_model("<behaviors>");
  daemon.restart();
  EXPECT_TRUE(daemon.status()["model"].contains("refused"));
  EXPECT_EQ(daemon.refused(), 0u) << "nobody has asked for a reload";
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(daemon.connection("/out", "/in")["accepted"], 1);
  daemon.write_model(single_model());
  daemon.terminate();
  daemon.restart();
  EXPECT_EQ(daemon.connection("/out", "/in")["accepted"], 1);
}

// The service manager keeps what nobody else has any more.
TEST(Takeover, ByTheDescriptorStoreKeepsActivityThoughNobodyIsThere) {
  Daemon::Options options;
  options.arguments = {"--descriptor-store"};
  Daemon daemon(override_model(), options);
  {
    Component other("other");
    ASSERT_EQ(other.tell("output /stop"), "open");
    other.tell("signal /stop");
  }
  daemon.kill();
  daemon.restart_with_stored();
  EXPECT_TRUE(daemon.source("/stop")["active"]);
  EXPECT_EQ(daemon.generation(), 2u);
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(low.publish(Number{1}).delivered, 0u);
}

// What stayed would stand beside pages of the same names, and with it they would be given up.
TEST(Takeover, ByADescriptorStoreThatIsOfNoUseEmptiesIt) {
  Daemon::Options options;
  options.arguments = {"--descriptor-store"};
  Daemon daemon(override_model(), options);
  ASSERT_EQ(daemon.notify().stored().count("page-2-1"), 1u);
  daemon.kill();
  {
    const ScopedVariable notify("NOTIFY_SOCKET", daemon.notify().path());
    service::store("registry", shm::make_segment("of another version", 4096));
  }
  daemon.write_model(single_model());
  daemon.restart_with_stored();
  std::vector<std::string> names;
  for (const auto& [name, descriptor] : daemon.notify().stored()) names.push_back(name);
  EXPECT_EQ(names, (std::vector<std::string>{"board", "page-0-1", "registry"})) << daemon.log();
}

// The service was stopped and started again: nothing was left in the store.
TEST(Takeover, ByComponentsStoresWhatTheyHandBack) {
  Daemon::Options options;
  options.arguments = {"--descriptor-store"};
  Daemon daemon(override_model(), options);
  Component last("last");
  ASSERT_EQ(last.tell("output /stop"), "open");
  last.tell("signal /stop");
  daemon.terminate();
  std::vector<std::string> names;
  for (const auto& [name, descriptor] : daemon.notify().stored()) names.push_back(name);
  {
    const ScopedVariable notify("NOTIFY_SOCKET", daemon.notify().path());
    for (const std::string& name : names) service::discard_stored(name);
  }
  ASSERT_TRUE(daemon.notify().stored().empty());
  daemon.restart();
  await([&] { return daemon.source("/stop")["open"] == true; });
  last.end();
  daemon.kill();
  daemon.restart_with_stored();
  EXPECT_TRUE(daemon.source("/stop")["active"]) << daemon.log();
}

}  // namespace
}  // namespace arbiter::test
