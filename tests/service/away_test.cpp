// A daemon takes over while a component does not come back: it is stopped, has no thread that hears
// of it, no descriptor left, or dies meanwhile.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <thread>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

// Its swap has to wait for a component that is back and does not answer. What opened meanwhile was
// said to be in no model, and got nothing.
TEST(Takeover, WhoeverComesBeforeTheModelIsInForceWaitsForIt) {
  Daemon daemon(single_model());
  auto hello = RawClient::message(wire::MessageKind::kHello, "deaf");
  hello.value = wire::kWireVersion;
  hello.flags = wire::kComesBack | wire::kHasServiceThread;
  RawClient former(daemon.instance());
  former.send(hello);
  const wire::Received welcome = former.expect(wire::MessageKind::kWelcome);
  const auto segment = raw_output_segment();
  const wire::Received opened = open_raw_output(former, "/other", segment);
  daemon.kill();
  daemon.restart();
  RawClient back(daemon.instance());
  hello.flags |= wire::kRejoins;
  hello.link = welcome.message.link;
  back.send(hello, {welcome.descriptors[0].get(), welcome.descriptors[1].get()});
  back.expect(wire::MessageKind::kWelcome);
  auto output = RawClient::message(wire::MessageKind::kHandBackOutput, "/other");
  output.port = opened.message.port;
  output.id = opened.message.id;
  back.send(output, {segment.get(), opened.descriptors[0].get()});
  back.send(RawClient::message(wire::MessageKind::kHandedBack));
  back.expect(wire::MessageKind::kSync);
  Node node("test");
  auto in = node.input_port<Number>("/in");
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

TEST(Takeover, WithoutAServiceThreadComesWithTheNextCall) {
  Daemon daemon(only("a"));
  NodeOptions options;
  options.service_thread = false;
  Node node("test", options);
  auto a = node.output_port<Number>("/a");
  auto in = node.input_port<Number>("/in");
  while (a.publish(Number{1}).delivered == 0) node.service();
  daemon.kill();
  daemon.restart();
  EXPECT_EQ(a.publish(Number{2}).delivered, 1u);
  auto b = node.output_port<Number>("/b");
  EXPECT_TRUE(daemon.source("/a")["open"]);
  EXPECT_TRUE(daemon.input("/in")["open"]);
  daemon.kill();
  daemon.restart();
  std::atomic<bool> is_back{false};
  std::thread status([&] {
    EXPECT_TRUE(daemon.source("/a")["open"]);
    is_back = true;
  });
  while (!is_back) node.service();
  status.join();
}

// The same where its publisher lived on, and died without coming back.
TEST(Takeover, TheSourceOfOneThatDiesWhileItIsAwayIsReadAllTheSame) {
  Daemon daemon(override_model());
  Component stopped("stopped");
  ASSERT_EQ(stopped.tell("output /stop"), "open");
  Node node("test");
  auto other = node.output_port<Number>("/other");
  daemon.kill();
  stopped.process().stop();
  daemon.restart_without_model();
  ASSERT_TRUE(daemon.source("/stop")["away"]);
  stopped.kill();
  await([&] { return daemon.source("/stop")["away"] != true; });
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(low.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

TEST(Takeover, AStoppedComponentIsWaitedForButNotForLong) {
  Daemon daemon(fan_out_model(2));
  Component stopped("stopped");
  ASSERT_EQ(stopped.tell("input /in0 8 1 0"), "open");
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in1");
  out.publish(Number{1});
  EXPECT_EQ(stopped.tell("hold /in0"), "1");
  daemon.kill();
  stopped.process().stop();
  daemon.restart();
  EXPECT_EQ(daemon.generation(), 2u);
  EXPECT_TRUE(daemon.input("/in0")["away"]);
  // It holds a sample, and samples wait for it.
  for (int i = 2; i < 200; ++i) EXPECT_EQ(out.publish(Number{i}).delivered, 2u);
  try {
    auto thief = node.input_port<Number>("/in0");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("is kept for process"), std::string::npos)
        << error.what();
  }
  stopped.process().signal(SIGCONT);
  EXPECT_EQ(stopped.tell("held /in0"), "1");
  stopped.tell("give /in0");
  EXPECT_EQ(stopped.tell("take /in0"), "192");
  await([&] { return daemon.input("/in0")["away"] != true; });
  EXPECT_EQ(daemon.connection("/out", "/in0")["state"], "connected");
}

// The one of the lost conversation is all that it has left.
TEST(Takeover, WhoHasNoDescriptorForItsPortsKeepsThemAndComesLater) {
  Daemon daemon(single_model());
  Component poor("poor");
  ASSERT_EQ(poor.tell("output /out"), "open");
  const pid_t process = poor.process().pid();
  const std::string descriptors = "/proc/" + std::to_string(process) + "/fd/";
  rlimit all{};
  ASSERT_EQ(::prlimit(process, RLIMIT_NOFILE, nullptr, &all), 0);
  rlimit few{0, all.rlim_max};
  while (std::filesystem::is_symlink(descriptors + std::to_string(few.rlim_cur))) ++few.rlim_cur;
  ASSERT_EQ(::prlimit(process, RLIMIT_NOFILE, &few, nullptr), 0);
  daemon.kill();
  daemon.restart();
  EXPECT_TRUE(daemon.source("/out")["away"]);
  Node node("test");
  auto in = node.input_port<Number>("/in");
  EXPECT_THROW(static_cast<void>(node.output_port<Number>("/out")), Error);
  ASSERT_EQ(::prlimit(process, RLIMIT_NOFILE, &all, nullptr), 0);
  await([&] { return daemon.source("/out")["open"] == true; });
  await([&] { return poor.tell("publish /out 1") == "1 0 0"; });  // once they are connected again
  const auto sample =
      in.wait_for(std::chrono::hours::max());  // which hears of its publisher after that of it
  ASSERT_TRUE(sample);
  EXPECT_EQ((**sample).value, 1);
}

TEST(Takeover, TheNameOfOneThatDiesWhileItIsAwayIsFree) {
  Daemon daemon(single_model());
  Component stopped("stopped");
  ASSERT_EQ(stopped.tell("output /out"), "open");
  Node node("test");
  auto in = node.input_port<Number>("/in");
  daemon.kill();
  stopped.process().stop();
  daemon.restart();
  EXPECT_TRUE(daemon.source("/out")["away"]);
  stopped.kill();
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

// Nobody else has its activity page, so that it is lost with it. The other brings the memory back.
TEST(Takeover, TheNameOfOneThatDiesWithItsPageIsFree) {
  Daemon daemon(single_model());
  Component stopped("stopped");
  ASSERT_EQ(stopped.tell("output /out"), "open");
  Node node("test");
  auto other = node.output_port<Number>("/other");
  daemon.kill();
  stopped.process().stop();
  daemon.restart();
  EXPECT_TRUE(daemon.source("/out")["away"]);
  stopped.kill();
  auto in = node.input_port<Number>("/in");
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
  EXPECT_NE(daemon.log().find("nobody has handed back the activity of /out:"), std::string::npos);
}

// Nor does anybody miss what nobody has ever had open.
TEST(Takeover, SaysNothingOfActivityThatCannotBe) {
  Daemon daemon(single_model());
  Node node("test");
  auto other = node.output_port<Number>("/other");
  daemon.kill();
  daemon.restart();
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(daemon.log().find("the activity of"), std::string::npos) << daemon.log();
}

}  // namespace
}  // namespace arbiter::test
