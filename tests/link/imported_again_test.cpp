// Rule 5 of docs/hosts.md, where a model stops wanting a source and wants it again: what has come
// from it does not come twice.
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "tests/link/robot.hpp"
#include "tests/support/await.hpp"

namespace arbiter::test {
namespace {

// The head keeps the planner's last event for the rear, too, and says it to whoever begins to read.
class ImportedAgain : public LoopbackHosts {
 protected:
  // Until the base's link has not got the planner, which keeps its T, and then until it has it
  // again.
  void import_anew(const std::function<void()>& meanwhile = [] {}) {
    base_.daemon().load(source_model("1000s"));
    await([&] { return base_.described(kPlanner).empty(); });
    meanwhile();
    base_.daemon().load(motor_model("1000s"));
    base_.await_described(kPlanner, "host head");
  }
  // The head has said its last event once more, and it was known.
  bool has_come_twice() {
    return base_.described(kPlanner).find("that came twice") != std::string::npos;
  }

  Host head_{"head", runtime_, kNoRules, network()};
  Host base_{"base", runtime_, motor_model("1000s"), network()};
  Host rear_{"rear", runtime_, motor_model("1000s"), network()};
  Planner planner_{head_};
  Body body_{base_};
};

TEST_F(ImportedAgain, ASampleThatHasComeDoesNotComeAgain) {
  Body back(rear_);
  back.drive(planner_);
  std::int64_t taken = body_.drive(planner_);
  await([&] {
    if (const auto got = body_.motor().take()) taken = (*got)->number;
    return taken == planner_.published();
  });
  import_anew();
  await([&] {
    EXPECT_FALSE(body_.motor().take());
    return has_come_twice() || HasFailure();
  });
}

// It would end what a component of this host has begun since.
TEST_F(ImportedAgain, ADeactivationIsNotAppliedAgain) {
  const std::int64_t number = body_.drive(planner_);
  rear_.await_described(kPlanner, "host head");
  planner_.port().deactivate();
  await([&] { return body_.motor().winner() == std::nullopt; });
  import_anew([&] { Planner(base_, number, "near").publish(); });
  await([&] {
    EXPECT_EQ(body_.motor().winner(), kPlanner);
    return has_come_twice() || HasFailure();
  });
}

}  // namespace
}  // namespace arbiter::test
