// What passes between hosts, and what does not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/link/scene.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

struct Speed {
  std::int64_t number;
};

// A motor obeys the planner, or while that is silent the fallback.
std::string motor_model(const std::string& timeout) {
  return "<behaviors timeout='" + timeout + R"('>
    <behavior name="Hold"><config at="/Motor/speed:i">/Hold/speed:o</config></behavior>
    <behavior name="Drive"><config at="/Motor/speed:i">/Planner/speed:o</config>
      <inhibition>Hold</inhibition></behavior>
  </behaviors>)";
}

// The head has the planner, the base has the motor.
class TwoHosts : public testing::Test {
 protected:
  [[nodiscard]] std::vector<std::string> network() const {
    return {"--domain", std::to_string(domain_.number())};
  }
  // Publishes until the motor has it, and returns the sample's number.
  std::int64_t drive(OutputPort<Speed>& planner, InputPort<Speed>& motor) {
    for (;;) {
      planner.publish(Speed{++published_});
      if (const auto got = motor.wait_for(20ms)) {
        if (got->source() == "/Planner/speed:o") return (*got)->number;
      }
    }
  }

  const OwnDomain domain_;
  const TemporaryDirectory runtime_;
  std::int64_t published_ = 0;
};

TEST_F(TwoHosts, ASampleThatIsPublishedOnOneArrivesAtAPortOfTheOther) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Node brain = head.node("brain");
  auto planner = brain.output_port<Speed>("/Planner/speed:o");
  Node body = base.node("body");
  auto motor = body.input_port<Speed>("/Motor/speed:i");
  EXPECT_GT(drive(planner, motor), 0);
  EXPECT_EQ(motor.winner(), "/Planner/speed:o");
  EXPECT_THAT(base.described("/Planner/speed:o"), HasSubstr("host head"));
}

}  // namespace
}  // namespace arbiter::test
