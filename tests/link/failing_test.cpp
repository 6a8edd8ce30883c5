// Rules 3 and 4 of docs/hosts.md: links that are stopped, die and come back are silence, and after
// T the next in command; `forever` ends in an idle port; and nothing that has waited arrives.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/link/known_hosts.hpp"
#include "tests/link/robot.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::Not;

class FailingHosts : public LoopbackHosts {
 protected:
  explicit FailingHosts(const std::string& timeout = "300ms") : timeout_(timeout) {}

  const std::string timeout_;
  Host head_{"head", runtime_, source_model(timeout_), network()};
  Host base_{"base", runtime_, motor_model(timeout_), network()};
  Planner planner_{head_};
  Body body_{base_};
};

TEST_F(FailingHosts, ALinkThatDiesIsSilence) {
  body_.drive(planner_);
  head_.link().kill();
  body_.fall_back();
  head_.start_link();
  body_.drive(planner_);
}

TEST_F(FailingHosts, TheImportersLinkThatDiesIsSilenceToo) {
  body_.drive(planner_);
  base_.link().kill();
  body_.fall_back();
  base_.start_link();
  body_.drive(planner_);
}

// A link that was stopped sends what has waited for it. All of it is older than T by then.
TEST_F(FailingHosts, NothingThatWaitedForAStoppedExporterArrives) {
  body_.drive(planner_);
  head_.link().stop();
  for (int i = 0; i < 10; ++i) planner_.publish();
  const std::int64_t waited = planner_.published();
  await([&] { return !head_.daemon().source(kPlanner)["active"]; });
  body_.fall_back();
  head_.link().resume();
  EXPECT_GT(body_.drive(planner_), waited);
}

TEST_F(FailingHosts, NothingThatWaitedForAStoppedImporterArrives) {
  body_.drive(planner_);
  base_.link().stop();
  for (int i = 0; i < 10; ++i) planner_.publish();
  const std::int64_t waited = planner_.published();
  await([&] { return !head_.daemon().source(kPlanner)["active"]; });
  body_.fall_back();
  base_.link().resume();
  EXPECT_GT(body_.drive(planner_), waited);
}

TEST_F(FailingHosts, ADaemonThatIsRestartedLosesNothingOfTheLink) {
  for (;;) {
    body_.drive(planner_);
    const Presences before = presences_at("base");
    const std::size_t said = base_.log().size();
    base_.daemon().terminate();
    body_.drive(planner_);
    base_.daemon().restart();
    body_.drive(planner_);
    head_.daemon().terminate();
    body_.drive(planner_);
    head_.daemon().restart();
    body_.drive(planner_);
    base_.await_described(kPlanner, "host head");
    const std::string log = base_.log().substr(said);
    if (presences_at("base") != before) continue;  // head was lost, and is imported anew
    EXPECT_THAT(log, Not(HasSubstr("not imported")));
    return;
  }
}

// The link's ports are those of the daemon before, and so are the body's. Whoever starts the body
// again has not to think of the link.
TEST_F(FailingHosts, ADaemonThatKnowsNobodyLetsTheLinkInAgain) {
  body_.drive(planner_);
  base_.daemon().terminate();
  base_.daemon().lose_state();
  base_.daemon().restart();
  base_.see("the state of the last daemon is lost");
  Body started_again(base_);
  started_again.drive(planner_);
  await([&] {
    const nlohmann::json strangers = base_.daemon().status()["strangers"];
    return std::none_of(strangers.begin(), strangers.end(),
                        [](const nlohmann::json& each) { return each["node"] == "arbiter-link"; });
  });
  base_.await_described(kPlanner, "host head");
}

class ForeverHosts : public FailingHosts {
 protected:
  ForeverHosts() : FailingHosts("forever") {}
};

// A tap keeps more events than samples. On a machine that is busy they may be late.
TEST_F(ForeverHosts, SamplesThatWereOverwrittenCrossAsSignalsAndAreCounted) {
  await([&] {
    body_.drive(planner_);
    head_.link().stop();
    for (int i = 0; i < 200; ++i) planner_.publish();
    head_.link().resume();
    return base_.described(kPlanner).find(" without their samples") != std::string::npos;
  });
}

// There is no T that would end it. To stop is safe; to let the next one drive is not.
TEST_F(ForeverHosts, ASpeakerThatIsGoneLeavesThePortIdleAndInhibited) {
  body_.drive(planner_);
  head_.link().kill();
  body_.await_idle();
  EXPECT_EQ(body_.hold().publish(Speed{0}).delivered, 0U);
  head_.start_link();
  body_.drive(planner_);
}

TEST_F(ForeverHosts, APortThatIsClosedThereIsClosedHere) {
  body_.drive(planner_);
  { const Planner gone = std::move(planner_); }
  body_.await_idle();
}

}  // namespace
}  // namespace arbiter::test
