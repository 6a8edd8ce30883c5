// A gateway some of whose ports cannot be opened, by the policy or because somebody has them.
#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/gateway/bridge_scene.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::gateway {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Refused : public testing::Test {
 protected:
  // Whoever runs the tests: a line that names everyone counts for root, too.
  void start(const std::string& denied) {
    daemon_.emplace(kDriving,
                    test::Daemon::Options{
                        .arguments = {"--policy", files_.write("policy", policy_without(denied))}});
  }
  void reload(const std::string& denied) {
    files_.write("policy", policy_without(denied));
    daemon_->load(kDriving);
  }
  static std::string policy_without(const std::string& denied) {
    return (denied.empty() ? "" : "deny everyone " + denied + "\n") + "allow everyone all\n";
  }
  std::string described(const std::string& source) {
    const auto status = daemon_->source(source);
    return status.contains("described") ? status["described"].get<std::string>() : "";
  }
  // The program, to its end.
  static std::string arbiter(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), ARBITER_PROGRAMS "/arbiter");
    return test::run_program(arguments, {}).out;
  }
  [[nodiscard]] std::size_t refusals_in_the_log(const std::string& port) const {
    const std::string text = "may not open the output port " + port;
    const std::string log = daemon_->log();
    std::size_t count = 0;
    for (auto at = log.find(text); at != std::string::npos; at = log.find(text, at + 1)) ++count;
    return count;
  }

  test::TemporaryDirectory files_;
  std::optional<test::Daemon> daemon_;
};

TEST_F(Refused, AnEntryIsLeftOutAndTheOthersAreServed) {
  start("output /Nav/*");
  Running gateway;
  await([&] { return gateway.middleware.serves("/Joy/cmd:o") && gateway.middleware.outs() == 1; });
  EXPECT_FALSE(gateway.middleware.serves("/Nav/cmd:o"));
  EXPECT_EQ(gateway.middleware.deliver("/Joy/cmd:o", "left"), Incoming::Fate::kPassed);
  await([&] { return daemon_->input("/Base/cmd:i")["taken"] == 1; });
}

TEST_F(Refused, StatusAndWhySayWhoMayNotAndByWhichLine) {
  start("output /Nav/*");
  Running gateway;
  await([&] { return !daemon_->status()["refusals"].empty(); });
  const std::string who = "gateway (pid " + std::to_string(::getpid()) + ")";
  EXPECT_THAT(arbiter({"status"}), AllOf(HasSubstr("refused to " + who),
                                         HasSubstr("policy:1 says: deny everyone output /Nav/*")));
  EXPECT_THAT(arbiter({"why", "/Base/cmd:i", "/Nav/cmd:o"}),
              AllOf(HasSubstr("component " + who + " asked for the port "),
                    HasSubstr(" ago and was refused: "),
                    HasSubstr("may not open the output port /Nav/cmd:o")));
}

TEST_F(Refused, AnEntryIsTakenUpOnceThePolicyAllowsIt) {
  start("output /Nav/*");
  Running gateway;
  await([&] { return !daemon_->status()["refusals"].empty(); });
  reload("");
  await([&] { return gateway.middleware.serves("/Nav/cmd:o") && gateway.middleware.outs() == 1; });
  EXPECT_EQ(gateway.middleware.deliver("/Nav/cmd:o", "on"), Incoming::Fate::kPassed);
  await([&] { return daemon_->input("/Base/cmd:i")["taken"] == 1; });
  await([&] { return described("/Nav/cmd:o") != ""; });
  EXPECT_TRUE(daemon_->status()["refusals"].empty());
  EXPECT_THAT(arbiter({"status"}), Not(HasSubstr("refused to")));
}

TEST_F(Refused, APortThatMayNotBeReadIsTakenUpToo) {
  start("input /Base/*");
  Running gateway;
  await([&] {
    return gateway.middleware.serves("/Nav/cmd:o") && !daemon_->status()["refusals"].empty();
  });
  EXPECT_EQ(gateway.middleware.outs(), 0u);
  EXPECT_THAT(arbiter({"why", "/Base/cmd:i"}),
              HasSubstr("may not open the input port /Base/cmd:i"));
  gateway.middleware.deliver("/Nav/cmd:o", "nobody takes it");
  reload("");
  await([&] { return gateway.middleware.outs() == 1; });
  gateway.middleware.deliver("/Nav/cmd:o", "on");
  await([&] { return daemon_->input("/Base/cmd:i")["taken"] == 1; });
}

TEST_F(Refused, OfATopicThatIsTwoSourcesNeitherIsOpenedWhereOneMayNotBe) {
  start("output /EStop/released:o");
  Running gateway("gateway",
                  "<in topic='/stop' type='std_msgs/msg/Bool' true='/EStop/pressed:o' "
                  "false='/EStop/released:o'/>");
  await([&] { return !daemon_->status()["refusals"].empty(); });
  EXPECT_FALSE(gateway.middleware.serves("/EStop/pressed:o"));
  reload("");
  await([&] { return gateway.middleware.serves("/EStop/pressed:o"); });
}

// Asked to yield each second, a link that stands in for it would stop and start all the time.
TEST_F(Refused, WhileOneOfTwoSourcesMayNotBeOpenedTheOtherIsLeftAlone) {
  start("output /EStop/released:o");
  Running gateway("gateway",
                  "<in topic='/stop' type='std_msgs/msg/Bool' true='/EStop/pressed:o' "
                  "false='/EStop/released:o'/>");
  await([&] { return !daemon_->status()["refusals"].empty(); });
  Node link("link");
  std::optional<OutputPort<void>> stand_in;
  await([&] {  // the gateway closes its own
    try {
      OutputPortOptions options;
      options.yields = true;
      stand_in.emplace(link.output_port("/EStop/pressed:o", options));
    } catch (const Error&) {
    }
    return stand_in.has_value();
  });
  for (int i = 0; i < 2; ++i) {
    const auto last = daemon_->status()["refusals"];
    await([&] { return stand_in->asked_to_yield() || daemon_->status()["refusals"] != last; });
  }
  EXPECT_FALSE(stand_in->asked_to_yield());
  reload("");
  await([&] { return stand_in->asked_to_yield(); });
  stand_in.reset();
  await([&] { return gateway.middleware.serves("/EStop/pressed:o"); });
}

// It asks again every second.
TEST_F(Refused, TheDaemonsLogSaysItOnce) {
  start("output /Nav/*");
  Running gateway;
  await([&] { return !daemon_->status()["refusals"].empty(); });
  const auto first = daemon_->status()["refusals"][0]["at_ns"];
  for (int i = 0; i < 2; ++i) {
    const auto last = daemon_->status()["refusals"][0]["at_ns"];
    await([&] { return daemon_->status()["refusals"][0]["at_ns"] != last; });
  }
  EXPECT_NE(daemon_->status()["refusals"][0]["at_ns"], first);
  EXPECT_EQ(refusals_in_the_log("/Nav/cmd:o"), 1u);
}

TEST_F(Refused, WhoMayOpenNothingWaits) {
  start("output,input *");
  Running gateway;
  await([&] { return daemon_->status()["refusals"].size() == 3; });
  reload("");
  await([&] { return gateway.middleware.serves("/Nav/cmd:o"); });
  await([&] { return gateway.middleware.outs() == 1; });
}

// Of so many one round of the loop tries some: the next one begins behind them.
TEST_F(Refused, OneBehindVeryManyIsTakenUpToo) {
  start("output *");
  std::string entries;
  for (int i = 0; i < 1000; ++i) {
    entries += "<in topic='/no" + std::to_string(i) + "' type='a/msg/B' port='/No/" +
               std::to_string(i) + ":o' max_size='64'/>";
  }
  Running gateway("gateway", entries + kEntries);
  await([&] { return gateway.middleware.outs() == 1; });
  reload("output /No/*");
  await([&] { return gateway.middleware.serves("/Nav/cmd:o"); });
}

TEST_F(Refused, APortThatSomebodyElseHasIsTakenUpWhenItIsFree) {
  start("");
  Node node("other");
  std::optional<OutputPort<void>> taken(node.output_port("/Nav/cmd:o"));
  Running gateway;
  await([&] { return gateway.middleware.serves("/Joy/cmd:o"); });
  EXPECT_FALSE(gateway.middleware.serves("/Nav/cmd:o"));
  taken.reset();
  await([&] { return gateway.middleware.serves("/Nav/cmd:o"); });
}

// While it waits for an answer it serves nobody: it must not wait again in the next rounds, of
// which there are ten in a second, nor each second, as where it is refused.
void expect_that_it_seldom_asks(Running& gateway) {
  const int before = gateway.tries();
  await([&] { return gateway.tries() > before; });
  const int tends = gateway.middleware.tends();
  const int tries = gateway.tries();
  await([&] { return gateway.middleware.tends() >= tends + 40; });
  // The try before may have been answered yet, and the last round may be half counted.
  EXPECT_LE(gateway.tries() - tries, 2);
}

TEST_F(Refused, ADaemonThatIsStoppedIsSeldomAsked) {
  start("output /Nav/*");
  Running gateway;
  await([&] { return gateway.middleware.outs() == 1; });
  daemon_->process().stop();
  expect_that_it_seldom_asks(gateway);
  daemon_->process().resume();
}

// It is not let in as a watcher, so it does not learn that the daemon has gone.
TEST_F(Refused, ADaemonThatHasGoneIsSeldomAskedByWhoMayNotObserve) {
  start("observe\ndeny everyone output /Nav/*");
  Running gateway;
  await([&] { return gateway.middleware.outs() == 1; });
  daemon_->kill();
  expect_that_it_seldom_asks(gateway);
}

// Whatever each of them got first, no entry is without a gateway, and none has two.
TEST_F(Refused, TwoGatewaysOfTheSameMappingShareItAndOneTakesUpWhatTheOtherHad) {
  start("");
  std::optional<Running> one("one");
  Running two("two");
  const auto outs = [&] { return one->middleware.outs() + two.middleware.outs(); };
  const auto serving = [&](const std::string& source) {
    return one->middleware.serves(source) + two.middleware.serves(source);
  };
  await([&] { return serving("/Nav/cmd:o") != 0 && serving("/Joy/cmd:o") != 0 && outs() != 0; });
  EXPECT_EQ(serving("/Nav/cmd:o"), 1);
  EXPECT_EQ(serving("/Joy/cmd:o"), 1);
  EXPECT_EQ(outs(), 1u);
  one.reset();
  await([&] {
    return two.middleware.serves("/Nav/cmd:o") && two.middleware.serves("/Joy/cmd:o") &&
           two.middleware.outs() == 1;
  });
}

}  // namespace
}  // namespace arbiter::gateway
