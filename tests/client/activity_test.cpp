// Activity of sources, live: it follows arrivals alone, and belongs to the source.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/client/tapping.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using namespace std::chrono_literals;

bool is_active(Daemon& daemon, const std::string& source) {
  return daemon.source(source)["active"];
}

TEST(Activity, AnArrivalMakesItsSourceActiveAndTheConnectionTheWinner) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  EXPECT_FALSE(is_active(daemon, "/low"));
  EXPECT_TRUE(in.idle());
  EXPECT_EQ(low.publish(Number{1}).delivered, 1u);
  EXPECT_TRUE(is_active(daemon, "/low"));
  EXPECT_EQ(in.winner(), "/low");
  EXPECT_FALSE(in.idle());
}

TEST(Activity, ASignalIsAnArrivalWithoutASample) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  const Outcome outcome = low.signal();
  EXPECT_EQ(outcome.delivered, 0u);
  EXPECT_EQ(outcome.discarded, 0u);
  EXPECT_EQ(in.winner(), "/low");
  EXPECT_FALSE(in.take());
}

TEST(Activity, ASignalTellsAtHowManyPortsItsSourceIsNotTheWinner) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  high.signal();
  const Outcome outcome = low.signal();
  EXPECT_EQ(outcome.delivered, 0u);
  EXPECT_EQ(outcome.discarded, 1u);
}

TEST(Activity, ADiscardedSampleKeepsItsSourceActive) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  high.signal();
  EXPECT_EQ(low.publish(Number{1}).discarded, 1u);
  EXPECT_TRUE(is_active(daemon, "/low"));
  high.deactivate();
  EXPECT_EQ(in.winner(), "/low");
}

TEST(Activity, ASourceWithNobodyAtTheOtherEndIsActiveAllTheSame) {
  Daemon daemon(override_model());
  Node node("test");
  auto high = node.output_port<Number>("/high");
  const Outcome outcome = high.publish(Number{1});
  EXPECT_EQ(outcome.delivered + outcome.discarded, 0u);
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(in.winner(), "/high");
  EXPECT_EQ(low.publish(Number{2}).discarded, 1u);
}

TEST(Activity, DeactivatingEndsItAtOnce) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  high.signal();
  EXPECT_EQ(low.publish(Number{1}).delivered, 0u);
  high.deactivate();
  EXPECT_FALSE(is_active(daemon, "/high"));
  EXPECT_EQ(low.publish(Number{2}).delivered, 1u);
  EXPECT_EQ(take_from(in), 2);
}

// Who is asked since when a robot stands still must not be told when the stop was last repeated.
TEST(Activity, DeactivatingOnceMoreKeepsTheTimeOfTheFirst) {
  Daemon daemon(override_model());
  Node node("test");
  auto high = node.output_port<Number>("/high");
  Node other("watcher");
  auto tap = other.tap("/high");
  wait_until_watched(high, tap);
  high.signal();
  high.deactivate();
  high.deactivate();
  EXPECT_EQ(next_of(tap)->kind(), TapEventKind::signal);
  const auto first = next_of(tap);
  const auto again = next_of(tap);
  EXPECT_EQ(again->kind(), TapEventKind::deactivation);
  EXPECT_LT(first->time(), again->time());
  EXPECT_EQ(first->stands_since(), first->time());
  EXPECT_EQ(again->stands_since(), first->time());
}

// As a component that ends in good order does, whatever its T was.
TEST(Activity, WhoDeactivatesWhatIsOverAndClosesHasLostNoEvent) {
  Daemon daemon(override_model("1ns"));
  Node node("test");
  std::optional<OutputPort<Number>> high(node.output_port<Number>("/high"));
  Node other("watcher");
  auto tap = other.tap("/high");
  wait_until_watched(*high, tap);
  high->signal();
  high->deactivate();
  high->deactivate();
  high.reset();
  std::vector<TapEventKind> kinds;
  while (kinds.empty() || kinds.back() != TapEventKind::closed) {
    const auto event = tap.wait_for(kForever);
    if (!event) continue;
    EXPECT_EQ(event->lost(), 0u);
    kinds.push_back(event->kind());
    if (kinds.back() == TapEventKind::closed) EXPECT_TRUE(event->is_deactivated());
  }
  EXPECT_EQ(std::count(kinds.begin(), kinds.end(), TapEventKind::deactivation), 2);
}

TEST(Activity, EndsByItselfAfterItsTime) {
  Daemon daemon(override_model("1ns"));
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  high.signal();
  EXPECT_EQ(low.publish(Number{1}).delivered, 1u) << "1 ns after the override";
  EXPECT_EQ(take_from(in), 1) << "its own expiry does not drop a sample";
  EXPECT_TRUE(in.idle());
}

TEST(Activity, EachSourceMayHaveATimeOfItsOwn) {
  Daemon daemon(rules("<source port=\"/high\" timeout=\"forever\"/>" +
                          arbiter_at("/in", select("/low", "not /high") + select("/high")),
                      "1ns"));
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  high.signal();
  low.signal();
  EXPECT_EQ(in.winner(), "/high");
  EXPECT_EQ(daemon.source("/high")["timeout_ns"], "forever");
  EXPECT_EQ(daemon.source("/low")["timeout_ns"], 1);
}

TEST(Activity, AReloadLeavesRunningActivityAsItIs) {
  Daemon daemon(override_model("forever"));
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  high.signal();
  daemon.load(override_model("1ns"));
  EXPECT_EQ(low.publish(Number{1}).discarded, 1u);
  high.signal();  // the T of the model in force at the arrival
  EXPECT_EQ(low.publish(Number{2}).delivered, 1u);
}

TEST(Activity, ClosingAPortDoesNotEndIt) {
  Daemon daemon(override_model("3600s"));
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  { node.output_port<Number>("/high").signal(); }
  EXPECT_EQ(low.publish(Number{1}).discarded, 1u);
  EXPECT_EQ(in.winner(), "/high");
}

TEST(Activity, TheDeathOfItsProcessDoesNotEndIt) {
  Daemon daemon(override_model("3600s"));
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  Component commander("commander");
  ASSERT_EQ(commander.tell("output /high"), "open");
  commander.tell("signal /high");
  commander.kill();
  EXPECT_EQ(low.publish(Number{1}).discarded, 1u);
  EXPECT_EQ(in.winner(), "/high");
}

TEST(Activity, ASuccessorCarriesItOnAndCanEndIt) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  Component commander("commander");
  ASSERT_EQ(commander.tell("output /high"), "open");
  commander.tell("signal /high");
  commander.kill();
  auto successor = node.output_port<Number>("/high");
  EXPECT_EQ(in.winner(), "/high");
  EXPECT_EQ(low.publish(Number{1}).discarded, 1u);
  successor.deactivate();
  EXPECT_EQ(low.publish(Number{2}).delivered, 1u);
}

TEST(Activity, AnOperatorCanDeactivateASourceWhoseProcessIsGone) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  Component commander("commander");
  ASSERT_EQ(commander.tell("output /high"), "open");
  commander.tell("signal /high");
  RawClient operator_(daemon.instance());
  operator_.hello("operator");
  operator_.send(RawClient::message(wire::MessageKind::kDeactivate, "/high"));
  EXPECT_NE(operator_.expect_refusal().find("held by node \"commander\""), std::string::npos);
  commander.kill();
  operator_.send(RawClient::message(wire::MessageKind::kDeactivate, "/high"));
  EXPECT_EQ(operator_.expect(wire::MessageKind::kDone).message.value, 1u);
  EXPECT_EQ(low.publish(Number{1}).delivered, 1u);
}

TEST(Activity, AnOperatorsDeactivationTellsAPortThatWaitsThatItIsIdle) {
  Daemon daemon(override_model());
  Component commander("commander");
  ASSERT_EQ(commander.tell("output /high"), "open");
  Component arm("arm");
  ASSERT_EQ(arm.tell("input /in 8 1 0"), "open");
  EXPECT_EQ(commander.tell("publish /high 5"), "1 0 0");
  EXPECT_EQ(arm.tell("wait /in"), "5");
  commander.kill();
  arm.begin("wait /in");
  RawClient operator_(daemon.instance());
  operator_.hello("operator");
  operator_.send(RawClient::message(wire::MessageKind::kDeactivate, "/high"));
  operator_.expect(wire::MessageKind::kDone);
  EXPECT_EQ(arm.answer(), "idle");
}

}  // namespace
}  // namespace arbiter::test
