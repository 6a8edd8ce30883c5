// A port that yields (OutputPortOptions::yields), and the component that wants its name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/other_user.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::AnyOf;
using testing::HasSubstr;

OutputPortOptions yielding() {
  OutputPortOptions options;
  options.yields = true;
  return options;
}

NodeOptions hearing(std::function<void(const Notice&)> on_notice) {
  NodeOptions options;
  options.on_notice = std::move(on_notice);
  return options;
}

// A program that stands in for /out, and goes when it is asked to: on its node's service thread.
class StandIn {
 public:
  explicit StandIn(bool goes = true)
      : node_("stand-in", hearing([this, goes](const Notice& notice) {
                if (notice.kind != NoticeKind::asked_to_yield) return;
                said_ = notice.text;
                asked_in_port_ = notice.port;
                was_asked_ = port_->asked_to_yield();
                if (goes) port_.reset();
                ++notices_;
                notices_.notify_all();
              })),
        port_(node_.output_port<Number>("/out", yielding())) {}

  OutputPort<Number>& port() { return *port_; }
  // The name is free a little earlier than the notice is counted.
  void await_notice() const { notices_.wait(0); }
  [[nodiscard]] int notices() const { return notices_; }
  [[nodiscard]] const std::string& said() const { return said_; }
  [[nodiscard]] bool was_asked() const { return was_asked_; }
  [[nodiscard]] const std::string& asked_in_port() const { return asked_in_port_; }
  void open_again() { port_.emplace(node_.output_port<Number>("/out", yielding())); }
  void close() { port_.reset(); }
  // What the daemon has said by now: it is heard before the answer to what is asked next.
  void hear_all() { arbiter::test::hear_all(node_); }

 private:
  std::string said_;
  std::string asked_in_port_;
  bool was_asked_ = false;
  std::atomic<int> notices_{0};
  Node node_;
  std::optional<OutputPort<Number>> port_;
};

std::string error_of_opening(Node& node) {
  try {
    static_cast<void>(node.output_port<Number>("/out"));
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

// On a busy machine the one that yields may take longer than the daemon waits for it.
OutputPort<Number> open_patiently(Node& node, const std::string& name) {
  for (;;) {
    try {
      return node.output_port<Number>(name);
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("is held by"));
    }
  }
}

// So may the one that has to come back to a daemon that takes over.
bool has_to_be_asked_again(const std::string& answer) {
  return answer.find("is held by") != std::string::npos ||
         answer.find("is kept for") != std::string::npos;
}

std::string told_patiently(Component& component, const std::string& line) {
  std::string answer;
  do {
    answer = component.tell(line);
  } while (has_to_be_asked_again(answer));
  return answer;
}

TEST(Yielding, IsToldToTheNodeOfThePortAndTheComponentHasTheName) {
  Daemon daemon(single_model());
  Node node("component");
  auto in = node.input_port<Number>("/in");
  StandIn stand_in;
  EXPECT_EQ(stand_in.port().publish(Number{1}).delivered, 1U);
  EXPECT_FALSE(stand_in.port().asked_to_yield());
  auto out = open_patiently(node, "/out");
  stand_in.await_notice();
  EXPECT_EQ(stand_in.notices(), 1);
  EXPECT_TRUE(stand_in.was_asked());
  EXPECT_EQ(stand_in.asked_in_port(), "/out");
  EXPECT_THAT(stand_in.said(), HasSubstr("/out is asked to yield to node \"component\" (pid "));
  EXPECT_EQ(take_from(in), 1) << "what was published before stays";
  EXPECT_EQ(out.publish(Number{2}).delivered, 1U);
  EXPECT_EQ(take_from(in), 2);
}

// An activity that has no end of its own is the source's, whoever has the port.
TEST(Yielding, LeavesTheSourcesActivityAsItIs) {
  Daemon daemon(override_model());
  Node node("component");
  auto in = node.input_port<Number>("/in");
  auto low = node.output_port<Number>("/low");
  Node other("stand-in", hearing([](const Notice&) {}));
  std::optional<OutputPort<Number>> high = other.output_port<Number>("/high", yielding());
  high->publish(Number{1});
  std::thread closes([&] {
    while (!high->asked_to_yield()) std::this_thread::yield();
    high.reset();
  });
  auto successor = open_patiently(node, "/high");
  closes.join();
  EXPECT_EQ(low.publish(Number{2}).discarded, 1U) << "/high is active yet";
  EXPECT_EQ(take_from(in), 1);
  EXPECT_EQ(in.winner(), "/high");
  successor.deactivate();
  EXPECT_EQ(low.publish(Number{3}).delivered, 1U);
}

TEST(Yielding, PortsHaveTheNameAgainOnceTheComponentHasGone) {
  Daemon daemon(single_model());
  StandIn stand_in;
  {
    Node node("component");
    auto out = open_patiently(node, "/out");
    EXPECT_THROW(stand_in.open_again(), Error) << "it displaces nobody";
    EXPECT_EQ(out.publish(Number{1}).refused, 0U);
    EXPECT_FALSE(out.asked_to_yield());
  }
  stand_in.open_again();
  EXPECT_EQ(daemon.source("/out")["component"]["node"], "stand-in");
}

TEST(Yielding, PortsThatStayKeepTheName) {
  Daemon daemon(single_model());
  StandIn stand_in(false);
  Node node("component");
  EXPECT_THAT(error_of_opening(node), HasSubstr("is held by node \"stand-in\""));
  EXPECT_THAT(error_of_opening(node), HasSubstr("is held by node \"stand-in\""));
  stand_in.hear_all();
  stand_in.await_notice();
  EXPECT_EQ(stand_in.notices(), 1) << "it is said once";
  stand_in.close();
  EXPECT_EQ(error_of_opening(node), "");
}

TEST(Yielding, IsSeenByServiceWhereThereIsNoThread) {
  Daemon daemon(single_model());
  NodeOptions options = hearing([](const Notice&) {});
  options.service_thread = false;
  Node other("stand-in", options);
  std::optional<OutputPort<Number>> port = other.output_port<Number>("/out", yielding());
  Component component("component");
  component.begin("output /out");
  while (!port->asked_to_yield()) {
    pollfd news{other.service_fd(), POLLIN, 0};
    ASSERT_EQ(::poll(&news, 1, -1), 1);
    other.service();
  }
  port.reset();
  EXPECT_THAT(component.answer(), AnyOf("open", HasSubstr("is held by")));
}

TEST(Yielding, APortOfAProcessThatIsStoppedOrKilledHoldsNobodyUp) {
  Daemon daemon(single_model());
  Component other("stand-in");
  ASSERT_EQ(other.tell("output-that-yields /out"), "open");
  other.process().stop();
  Node node("component");
  EXPECT_THAT(error_of_opening(node), HasSubstr("is held by node \"stand-in\""));
  EXPECT_EQ(daemon.source("/out")["component"]["node"], "stand-in");
  Component waiting("waiting");
  waiting.begin("output /out");
  other.kill();
  EXPECT_THAT(waiting.answer(), AnyOf("open", HasSubstr("is held by")));
  EXPECT_TRUE(error_of_opening(node).empty() || daemon.source("/out")["open"].get<bool>());
}

// The policy decides first: the one that yields does not even hear of it.
TEST(Yielding, IsNotAskedOfAPortByWhoMayNotOpenItsName) {
  if (!may_be_another_user()) GTEST_SKIP() << "only root can start processes of other users";
  const TemporaryDirectory files;
  const std::string policy =
      files.write("policy", "deny user 65534 output /out\nallow everyone all\n");
  Daemon daemon(single_model(), {.arguments = {"--policy", policy}});
  ASSERT_EQ(::chmod(daemon.directory().c_str(), 0711), 0);
  StandIn stand_in(false);
  Component other(
      "other",
      {"/bin/sh", "-c", R"(exec setpriv --reuid=65534 --regid=65534 --clear-groups "$0" "$@")"});
  EXPECT_THAT(other.tell("output /out"), HasSubstr("may not"));
  stand_in.hear_all();
  EXPECT_EQ(stand_in.notices(), 0);
}

// The next daemon knows which ports yield, and is asked again.
TEST(Yielding, GoesOnUnderTheNextDaemon) {
  Daemon daemon(single_model());
  StandIn stand_in;
  Component component("component");
  daemon.kill();
  daemon.restart();
  EXPECT_EQ(told_patiently(component, "output /out"), "open");
  stand_in.await_notice();
  EXPECT_EQ(stand_in.notices(), 1);
}

// The daemon dies when it has asked the holder, and nobody has answered.
TEST(Yielding, IsAskedAgainByADaemonThatTakesOver) {
  Daemon daemon(single_model());
  StandIn stand_in(false);
  Component component("component");
  component.begin("output /out");
  stand_in.await_notice();
  daemon.kill();
  stand_in.close();
  daemon.restart();
  std::string answer = component.answer();
  if (has_to_be_asked_again(answer)) answer = told_patiently(component, "output /out");
  EXPECT_EQ(answer, "open");
}

}  // namespace
}  // namespace arbiter::test
