// Components switch between models that the daemon has loaded.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

// The models "default" and "other".
class Switch : public testing::Test {
 protected:
  Daemon& start(const std::string& model, const std::string& other,
                const std::vector<std::string>& arguments = {}) {
    Daemon::Options options;
    options.arguments = {"--model", "other=" + files_.write("other.xml", other)};
    options.arguments.insert(options.arguments.end(), arguments.begin(), arguments.end());
    return daemon_.emplace(model, options);
  }

  TemporaryDirectory files_;
  std::optional<Daemon> daemon_;
};

TEST_F(Switch, IsInForceWhenItReturns) {
  start(only("a"), only("b"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto b = node.output_port<Number>("/b");
  auto in = node.input_port<Number>("/in");
  for (int i = 0; i < 20; ++i) {
    node.switch_model("other");
    EXPECT_EQ(a.publish(Number{1}).delivered, 0u);
    EXPECT_EQ(b.publish(Number{2}).delivered, 1u);
    EXPECT_EQ(take_from(in), 2);
    node.switch_model("default");
    EXPECT_EQ(b.publish(Number{3}).delivered, 0u);
    EXPECT_EQ(a.publish(Number{4}).delivered, 1u);
    EXPECT_EQ(take_from(in), 4);
    EXPECT_FALSE(in.take());
  }
  EXPECT_EQ(daemon_->generation(), 41u);
}

TEST_F(Switch, WithoutAServiceThread) {
  start(only("a"), only("b"));
  NodeOptions options;
  options.service_thread = false;
  Node node("test", options);
  auto b = node.output_port<Number>("/b");
  auto in = node.input_port<Number>("/in");
  node.switch_model("other");
  while (b.publish(Number{1}).delivered == 0) node.service();
  EXPECT_EQ(take_from(in), 1);
}

// The models take turns in connecting /out to one port or the other; a sample that were decided by
// both, or by neither, would get to two ports, or to none.
TEST_F(Switch, EverySampleIsDecidedByOneModelAtAllPorts) {
  start(only("out", "/in0"), only("out", "/in1"));
  Node node("test");
  Node other("other");
  auto out = node.output_port<Number>("/out");
  auto in0 = other.input_port<Number>("/in0");
  auto in1 = other.input_port<Number>("/in1");
  std::atomic<bool> stop{false};
  std::thread publisher([&] {
    for (std::int64_t value = 1; !stop; ++value) {
      const Outcome outcome = out.publish(Number{value});
      ASSERT_EQ(outcome.delivered, 1u) << value << ": discarded " << outcome.discarded;
    }
  });
  for (int i = 0; i < 300; ++i) other.switch_model(i % 2 == 0 ? "other" : "default");
  stop = true;
  publisher.join();
  const auto source = daemon_->source("/out");
  EXPECT_EQ(source["published"], source["delivered"]) << source;
}

TEST_F(Switch, ToTheOneInForceChangesNothing) {
  start(only("a"), only("b"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto in = node.input_port<Number>("/in");
  a.publish(Number{1});
  node.switch_model("default");
  EXPECT_EQ(daemon_->generation(), 1u);
  EXPECT_EQ(take_from(in), 1) << "what waits is not lost";
}

TEST_F(Switch, ToAModelThatThereIsNotNamesThoseThatThereAre) {
  start(only("a"), only("b"));
  Node node("test");
  EXPECT_EQ(error_of([&] { node.switch_model("third"); }),
            "there is no model \"third\"; there are: default and other");
  EXPECT_THAT(error_of([&] { node.switch_model(""); }),
              HasSubstr("there is no model of that name; there are: "));
  EXPECT_THAT(error_of([&] { node.switch_model(std::string_view("other\0", 6)); }),
              HasSubstr("there is no model of that name; there are: "));
  EXPECT_THAT(error_of([&] { node.switch_model(std::string(1000, 'x')); }),
              HasSubstr("there are: default and other"));
  EXPECT_EQ(daemon_->generation(), 1u);
}

TEST_F(Switch, IsRefusedWhereThePolicyForbidsIt) {
  const auto policy = files_.write("policy", "deny everyone switch\nallow everyone all\n");
  start(only("a"), only("b"), {"--policy", policy});
  Node node("test");
  EXPECT_THAT(
      error_of([&] { node.switch_model("other"); }),
      HasSubstr("may not switch to another model: " + policy + ":1 says: deny everyone switch"));
  EXPECT_EQ(daemon_->generation(), 1u);
}

TEST_F(Switch, DoesNotWaitForLongForAComponentThatDoesNotRun) {
  start(only("a"), only("b"));
  Component stopped("stopped");
  ASSERT_EQ(stopped.tell("input /in 8 1 0"), "open");
  Node node("test");
  auto b = node.output_port<Number>("/b");
  stopped.process().stop();
  node.switch_model("other");
  EXPECT_EQ(b.publish(Number{1}).delivered, 1u);
  stopped.process().signal(SIGCONT);
  std::string taken = "none";
  while (taken == "none") taken = stopped.tell("take /in");  // once it has heard of the publisher
  EXPECT_EQ(taken, "1");
}

TEST_F(Switch, FromSeveralThreadsAtOnceEachHappens) {
  start(only("a"), only("b"));
  Node node("test");
  auto in = node.input_port<Number>("/in");
  const auto switch_often = [&] {
    for (int i = 0; i < 25; ++i) node.switch_model(i % 2 == 0 ? "other" : "default");
  };
  std::thread one(switch_often);
  std::thread two(switch_often);
  one.join();
  two.join();
  node.switch_model("other");
  EXPECT_EQ(daemon_->status()["model"]["name"], "other");
}

TEST_F(Switch, WhileComponentsComeAndGo) {
  start(only("a"), only("b"));
  Node node("test");
  auto in = node.input_port<Number>("/in");
  std::atomic<bool> stop{false};
  std::thread switcher([&] {
    for (int i = 0; !stop; ++i) node.switch_model(i % 2 == 0 ? "other" : "default");
  });
  for (int i = 0; i < 20; ++i) {
    Component sender("sender");
    ASSERT_EQ(sender.tell(i % 2 == 0 ? "output /a" : "output /b"), "open");
    if (i % 4 < 2) sender.kill();
  }
  stop = true;
  switcher.join();
  node.switch_model("default");
  auto a = node.output_port<Number>("/a");
  EXPECT_EQ(a.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
  EXPECT_EQ(daemon_->input("/in")["misbehaved"], 0);
}

// The next daemon is asked again, wherever the last one was when it died.
TEST_F(Switch, OutlivesTheDaemon) {
  start(only("a"), only("b"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto b = node.output_port<Number>("/b");
  auto in = node.input_port<Number>("/in");
  for (int i = 0; i < 4; ++i) {
    const bool to_other = i % 2 == 0;
    std::atomic<bool> begins{false};
    std::thread switcher([&] {
      begins = true;
      node.switch_model(to_other ? "other" : "default");
    });
    while (!begins) {
    }
    daemon_->kill();
    daemon_->restart();
    switcher.join();
    EXPECT_EQ(daemon_->status()["model"]["name"], to_other ? "other" : "default");
    EXPECT_EQ(a.publish(Number{1}).delivered, to_other ? 0u : 1u);
    EXPECT_EQ(b.publish(Number{2}).delivered, to_other ? 1u : 0u);
    EXPECT_EQ(take_from(in), to_other ? 2 : 1);
  }
}

}  // namespace
}  // namespace arbiter::test
