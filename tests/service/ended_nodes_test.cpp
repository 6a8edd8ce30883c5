// A daemon takes over when a component has no port left, or has ended while there was no daemon.
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/raw_port.hpp"
#include "wire/call.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::Not;

void expect_what_was_active(Daemon& daemon, Node& node) {
  daemon.kill();
  daemon.restart();
  EXPECT_TRUE(daemon.source("/stop")["active"]);
  EXPECT_EQ(daemon.generation(), 2u);
  auto low = node.output_port<Number>("/low");
  EXPECT_EQ(low.publish(Number{1}).delivered, 0u);
}

TEST(Takeover, FromAComponentWithoutPortsKeepsWhatIsActive) {
  Daemon daemon(override_model());
  Node node("test");
  auto in = std::make_optional(node.input_port<Number>("/in"));
  node.output_port<Number>("/stop").signal();
  in.reset();
  expect_what_was_active(daemon, node);
}

TEST(Takeover, FromAComponentThatOnlyTapsKeepsWhatIsActive) {
  Daemon daemon(override_model());
  Node node("test");
  node.output_port<Number>("/stop").signal();
  auto tap = node.tap<Number>("/low");
  expect_what_was_active(daemon, node);
  await([&] { return tap.take().has_value(); });
}

TEST(Takeover, AComponentWithoutPortsIsANewcomerToOtherMemory) {
  Daemon daemon(single_model());
  Node node("test");
  static_cast<void>(node.output_port<Number>("/out"));
  daemon.kill();
  daemon.lose_state();
  daemon.restart();
  EXPECT_EQ(daemon.generation(), 1u);
  auto in = node.input_port<Number>("/in");
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
  EXPECT_TRUE(daemon.status()["strangers"].empty());
}

// Its process has ended before the daemon reads what it has said, which is more than one turn's.
TEST(Deaths, AreNotThoseOfComponentsThatCloseAllBeforeTheyEnd) {
  Daemon daemon(single_model());
  Component component("component");
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(component.tell("output /out" + std::to_string(i)), "open");
  }
  daemon.process().stop();
  EXPECT_EQ(component.end(), 0);
  daemon.process().signal(SIGCONT);
  await([&] { return daemon.status()["clients"] == 1; });
  EXPECT_TRUE(daemon.status()["deaths"].empty()) << daemon.log();
}

// Another has asked for the name before, and is served first.
TEST(Deaths, AreNotThoseOfComponentsWhoseNamesAreAskedForAsTheyEnd) {
  Daemon daemon(single_model());
  Component component("component");
  ASSERT_EQ(component.tell("output /out"), "open");
  RawClient asking(daemon.instance());
  asking.hello("asking");
  const auto segment = raw_output_segment();
  daemon.process().stop();
  asking.send(RawClient::message(wire::MessageKind::kOpenOutput, "/out"), {segment.get(), -1});
  EXPECT_EQ(component.end(), 0);
  daemon.process().signal(SIGCONT);
  asking.expect(wire::MessageKind::kConnected);
  EXPECT_TRUE(daemon.status()["deaths"].empty()) << daemon.log();
  EXPECT_THAT(daemon.log(), HasSubstr("closed output port /out"));
}

// Its process lives, so the next daemon would keep its ports for it.
TEST(Takeover, OfANodeThatHasEndedTheNextOneOfItsProcessFreesThePorts) {
  Daemon daemon(single_model());
  Component other("other");  // by which the next daemon takes over
  ASSERT_EQ(other.tell("input /in 1 1 0"), "open");
  {
    Node node("test");
    auto out = node.output_port<Number>("/out");
    daemon.kill();
  }
  daemon.restart();
  Node node("test");
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
}

TEST(Takeover, OfANodeThatHasEndedAnotherOneOfItsProcessFreesThePorts) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  {
    Node ended("ended");
    auto out = ended.output_port<Number>("/out");
    daemon.kill();
  }
  daemon.restart();
  Component other("other");
  ASSERT_EQ(other.tell("output /out"), "open");
  EXPECT_EQ(other.tell("publish /out 1"), "1 0 0");
  EXPECT_EQ(take_from(in), 1);
}

// What it said last is in the socket of a daemon that does not read any more.
TEST(Takeover, OfANodeThatEndsBeforeAStoppedDaemonThePortsAreFreedToo) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  {
    Node ended("ended");
    auto out = ended.output_port<Number>("/out");
    daemon.process().stop();
  }
  daemon.kill();
  daemon.restart();
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

bool keeps_any(Daemon& daemon) {
  const auto status = daemon.status();
  return std::any_of(status["sources"].begin(), status["sources"].end(),
                     [](const auto& each) { return each["away"] == true; });
}

NodeOptions without_thread() {
  NodeOptions options;
  options.service_thread = false;
  options.connect_timeout = std::chrono::milliseconds(0);
  options.on_waiting = [](const std::string&) {};
  return options;
}

// A daemon that hangs until its watchdog kills it has read nothing of it.
TEST(Takeover, ThatANodeHasEndedIsSaidUntilADaemonHasReadIt) {
  Daemon daemon(single_model());
  Node node("test", without_thread());
  auto in = node.input_port<Number>("/in");
  {
    Node ended("ended");
    auto out = ended.output_port<Number>("/out");
    daemon.process().stop();
  }
  node.service();  // it is in the socket now
  daemon.kill();
  daemon.restart();
  await([&] {
    node.service();
    return !keeps_any(daemon);
  });
  Component other("other");
  EXPECT_EQ(other.tell("output /out"), "open");
}

TEST(Takeover, OfMoreNodesThanAnyoneCountsAllPortsAreFreed) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  std::vector<Node> ended;
  std::vector<OutputPort<Number>> ports;
  for (int i = 0; i < 80; ++i) {
    ended.emplace_back("ended", without_thread());
    ports.push_back(ended.back().output_port<Number>("/" + std::to_string(i)));
  }
  daemon.kill();
  ports.clear();
  ended.clear();
  daemon.restart();
  await([&] { return !keeps_any(daemon); });
}

void expect_left(Daemon& daemon) {
  const std::string left = "node \"ended\" (pid " + std::to_string(getpid()) + ") left\n";
  await([&] { return daemon.log().find(left) != std::string::npos; });
  EXPECT_TRUE(daemon.status()["deaths"].empty());
}

// A node does, and ends; the daemon has opened /out for it all the same.
void give_up_an_opening(Daemon& daemon) {
  Node ended("ended", without_thread());
  daemon.process().stop();
  EXPECT_THROW(static_cast<void>(ended.output_port<Number>("/out")), Error);
  daemon.process().resume();
  await([&] { return daemon.source("/out")["open"] == true; });
}

// What the socket had no room for is not told as a death.
TEST(EndedNode, HasLeftInGoodOrderThoughItsPortsWereOpen) {
  Daemon daemon(single_model());
  give_up_an_opening(daemon);
  await([&] { return daemon.source("/out")["open"] == false; });
  expect_left(daemon);
}

// Its own word may be read after that of another node of its process.
TEST(EndedNode, HasLeftInGoodOrderThoughAnotherNodeIsHeardFirst) {
  Daemon daemon(single_model());
  Node ended("ended", without_thread());
  auto out = ended.output_port<Number>("/out");
  wire::Caller caller;
  caller.name = "other";
  caller.instance = "test";
  const wire::Welcome other = wire::join(caller);
  wire::Message message;
  message.kind = wire::MessageKind::kNodeEnded;
  message.link = other.received.message.link - 1;
  ASSERT_EQ(wire::send_message(other.socket.get(), message), wire::SendResult::kSent);
  expect_left(daemon);
  EXPECT_THAT(daemon.log(), Not(HasSubstr("is away")));
  Component next("next");
  EXPECT_EQ(next.tell("output /out"), "open");
}

// Nobody else of its process says anything meanwhile.
TEST(EndedNode, IsToldByAnIdleNodeOfItsProcess) {
  Daemon daemon(single_model());
  Node idle("idle");
  auto in = idle.input_port<Number>("/in");
  {
    Node ended("ended", without_thread());
    std::vector<OutputPort<void>> ports;
    for (int i = 0; i < 300; ++i) ports.push_back(ended.output_port("/" + std::to_string(i)));
    daemon.process().stop();
  }
  daemon.process().resume();
  Component other("other");
  for (int i = 0; i < 300; i += 13) {
    EXPECT_EQ(other.tell("output /" + std::to_string(i)), "open") << i;
  }
}

TEST(EndedNode, LeavesNothingOfAnOpeningThatItDidNotWaitFor) {
  Daemon daemon(single_model());
  give_up_an_opening(daemon);
  Component other("other");
  EXPECT_EQ(other.tell("output /out"), "open");
}

// It has asked a stopped daemon for /out in vain; when it asks again, the daemon goes on.
class NodeThatGaveUp {
 public:
  explicit NodeThatGaveUp(Daemon& daemon) : daemon_(daemon), node_("test", options()) {
    daemon_.process().stop();
    EXPECT_THROW(static_cast<void>(node_.output_port<Number>("/out")), Error);
    is_second_ = true;
  }
  Node& node() { return node_; }

 private:
  NodeOptions options() {
    NodeOptions options;
    options.connect_timeout = std::chrono::milliseconds(0);
    options.on_waiting = [this](const std::string&) {
      if (is_second_) daemon_.process().resume();
    };
    return options;
  }

  Daemon& daemon_;
  bool is_second_ = false;
  Node node_;
};

// The daemon answers the first opening before the second, and gives the name to that.
TEST(Opening, AgainAfterADaemonDidNotAnswerIsNotRefusedForTheFirst) {
  Daemon daemon(single_model());
  NodeThatGaveUp gave_up(daemon);
  Node& node = gave_up.node();
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 0u);
}

// It is asked for once more, since the first one may have been in the way; another's port stays so.
TEST(Opening, BehindOneThatWasGivenUpIsRefusedForAnother) {
  Daemon daemon(single_model());
  Component holder("holder");
  ASSERT_EQ(holder.tell("output /out"), "open");
  NodeThatGaveUp gave_up(daemon);
  Node& node = gave_up.node();
  EXPECT_THAT(error_of([&] { auto out = node.output_port<Number>("/out"); }),
              HasSubstr("is held by node \"holder\""));
}

}  // namespace
}  // namespace arbiter::test
