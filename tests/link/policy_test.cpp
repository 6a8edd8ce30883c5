// What the policy of a host keeps its link from: what leaves, and what is imported.
#include <gtest/gtest.h>

#include <string>

#include "tests/link/robot.hpp"

namespace arbiter::test {
namespace {

// The head has what the motor obeys and what it falls back to. The policy of one host is about the
// first of the two alone, so the other one shows that the links do their work.
class HostsWithAPolicy : public LoopbackHosts {
 protected:
  [[nodiscard]] std::vector<std::string> denying(const std::string& what) const {
    return {"--policy", files_.write("policy", "deny everyone " + what + "\n")};
  }
  // From now on it is as if there were no such line.
  void allow(Host& host) const {
    files_.write("policy", "allow everyone all\n");
    host.daemon().hang_up();
  }

  const TemporaryDirectory files_;
};

// Both sources of the head publish; the motor of the base obeys those that come.
class PairOfSources {
 public:
  PairOfSources(const Host& head, const Host& base)
      : brain_(head.node("brain")),
        planner_(brain_.output_port<Speed>(kPlanner)),
        hold_(brain_.output_port<Speed>(kHold)),
        body_(base.node("body")),
        motor_(body_.input_port<Speed>(kMotor)) {}

  // The source of the next sample that commands the motor.
  std::string next() {
    for (;;) {
      planner_.publish(Speed{1});
      hold_.publish(Speed{2});
      if (const auto got = motor_.wait_for(5ms)) return std::string(got->source());
    }
  }
  void expect_hold_alone() {
    for (int i = 0; i < 20; ++i) ASSERT_EQ(next(), kHold);
  }
  void await_planner() {
    await([&] { return next() == kPlanner; });
  }

 private:
  Node brain_;
  OutputPort<Speed> planner_;
  OutputPort<Speed> hold_;
  Node body_;
  InputPort<Speed> motor_;
};

TEST_F(HostsWithAPolicy, ASourceThatMayNotBeTappedIsOfferedAndNeverSent) {
  Host head("head", runtime_, kNoRules, network(), {}, denying("tap /Planner/*"));
  Host base("base", runtime_, motor_model("300ms"), network());
  PairOfSources sources(head, base);
  head.see("/Planner/speed:o cannot be sent to the hosts that want it: ");
  head.see("may not tap");
  base.see("/Planner/speed:o comes from host head");
  sources.expect_hold_alone();
  EXPECT_FALSE(base.daemon().source(kPlanner)["active"]);
  allow(head);
  sources.await_planner();
}

TEST_F(HostsWithAPolicy, ASourceThatMayNotBeOpenedIsNotImported) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("300ms"), network(), {}, denying("output /Planner/*"));
  PairOfSources sources(head, base);
  base.see("/Planner/speed:o of host head is not imported: ");
  base.see("may not open the output port /Planner/speed:o");
  sources.expect_hold_alone();
  EXPECT_EQ(base.described(kPlanner), "");
  allow(base);
  sources.await_planner();
  base.see("/Planner/speed:o comes from host head");
}

}  // namespace
}  // namespace arbiter::test
