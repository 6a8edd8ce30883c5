// Which model the next daemon puts in force.
#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>

#include "service/models/history.hpp"
#include "tests/client/component.hpp"
#include "tests/client/samples.hpp"
#include "tests/service/changing_models.hpp"

namespace arbiter::test {
namespace {

using wire::MessageKind;

TEST_F(ChangingModels, TheNextDaemonGoesOnWithTheModelOfThatName) {
  Daemon& daemon = start();
  Node node("test");
  auto b = node.output_port<Number>("/b");
  auto in = node.input_port<Number>("/in");
  ASSERT_EQ(arbiter({"switch", "other"}).exit_code, 0);
  daemon.kill();
  daemon.restart();
  EXPECT_EQ(name_in_force(), "other");
  EXPECT_EQ(b.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
  const auto history = daemon.status()["history"];
  ASSERT_EQ(history.size(), 2u);
  EXPECT_EQ(history[0]["how"], "start");
  EXPECT_EQ(history[1]["how"], "takeover");
  EXPECT_EQ(history[1]["name"], "other");
  expect_refusal(arbiter({"rollback"}),
                 "model 2 was in force before this daemon started; only its name is known");
}

TEST_F(ChangingModels, TheNextDaemonThatLacksTheModelBeginsWithItsFirst) {
  Daemon& daemon = start();
  Node node("test");
  auto in = node.input_port<Number>("/in");
  daemon.write_model(only("c"));
  ASSERT_EQ(arbiter({"switch", "other"}).exit_code, 0);
  daemon.kill();
  daemon.restart_without_model();  // it has "other" yet
  EXPECT_EQ(name_in_force(), "other");
  EXPECT_EQ(source_in_force(), "/b");
}

// Whenever it dies, what was in force goes on under its name.
TEST_F(ChangingModels, ADaemonKilledInTheMiddleOfASwitchLeavesOneOfTheTwo) {
  Daemon& daemon = start();
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto b = node.output_port<Number>("/b");
  auto in = node.input_port<Number>("/in");
  Component stopped("stopped");
  ASSERT_EQ(stopped.tell("output /c"), "open");
  for (int i = 0; i < 3; ++i) {
    RawClient client(daemon.instance());
    client.hello("asks");
    stopped.process().stop();  // what the switch waits for
    client.send(RawClient::message(MessageKind::kSwitch, i % 2 == 0 ? "other" : "default"));
    while (a.publish(Number{1}).delivered + b.publish(Number{2}).delivered == 0) {
    }
    daemon.kill();
    stopped.process().signal(SIGCONT);
    daemon.restart();
    const auto history = daemon.status()["history"];
    ASSERT_EQ(history.size(), 2u);
    EXPECT_EQ(history[0]["name"], history[1]["name"]);
    const bool is_other = history[0]["name"] == "other";
    EXPECT_EQ(a.publish(Number{1}).delivered, is_other ? 0u : 1u);
    EXPECT_EQ(b.publish(Number{2}).delivered, is_other ? 1u : 0u);
  }
}

TEST_F(ChangingModels, ARollbackSaysThatModelsBeforeTheStartAreGoneThoughTheirNamesAreToo) {
  Daemon& daemon = start();
  Node node("test");
  auto in = node.input_port<Number>("/in");
  daemon.kill();
  daemon.restart();
  expect_refusal(arbiter({"rollback"}),
                 "model 1 was in force before this daemon started; only its name is known");
  for (std::size_t i = 0; i < service::History::kMaxEntries; ++i) {
    ASSERT_EQ(arbiter({"reload"}).exit_code, 0);
  }
  expect_refusal(arbiter({"rollback"}),
                 "there is no model to go back to: this daemon keeps none from before its start");
}

// A robot comes back by itself: what somebody has half written does not keep it from that.
TEST_F(ChangingModels, OfABrokenFileTheModelInForceStaysWithTheNextDaemon) {
  Daemon& daemon = start();
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto in = node.input_port<Number>("/in");
  daemon.kill();
  daemon.write_model("<behaviors>");
  daemon.restart();
  EXPECT_EQ(daemon.generation(), 1u);
  EXPECT_EQ(name_in_force(), "default");
  expect_refusal(arbiter({"rollback"}),
                 "there is no model to go back to: this daemon keeps none from before its start");
  EXPECT_EQ(a.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
  {
    Component other("other");  // as one that has been restarted
    ASSERT_EQ(other.tell("output /b"), "open");
    EXPECT_EQ(other.tell("publish /b 2"), "0 0 0") << "which the model in force does not mention";
  }
  const auto refused = arbiter({"switch", "other"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err,
              HasSubstr("there is no model \"other\"; none is loaded, because the files of --model "
                        "were refused, and the last daemon's model stays in force; mend them, then "
                        "run arbiter reload; the first error: "));
  EXPECT_EQ(arbiter({"reload"}).exit_code, 1);
  daemon.write_model(only("c"));
  EXPECT_EQ(arbiter({"reload"}).exit_code, 0);
  EXPECT_EQ(source_in_force(), "/c");
}

// Without its policy, everybody might do what only some may.
TEST_F(ChangingModels, OfABrokenPolicyThereIsNoNextDaemon) {
  const std::string policy = files_.write("policy", "allow user root output /a\n");
  Daemon& daemon = start({"--policy", policy});
  Node node("test");
  auto a = node.output_port<Number>("/a");
  daemon.kill();
  files_.write("policy", "alow user root output /a\n");
  const ProgramResult next =
      run_program({arbiterd_path(), "--instance", daemon.instance(), "--policy", policy, "--model",
                   files_.write("good.xml", only("a"))});
  EXPECT_EQ(next.exit_code, 1);
  EXPECT_NE(next.err.find("not started: the files have errors"), std::string::npos) << next.err;
}

TEST_F(ChangingModels, TheDescriptorStoreKeepsTheNameToo) {
  Daemon& daemon = start({"--descriptor-store"});
  ASSERT_EQ(arbiter({"switch", "other"}).exit_code, 0);
  daemon.kill();
  daemon.restart_with_stored();
  EXPECT_EQ(name_in_force(), "other");
}

}  // namespace
}  // namespace arbiter::test
