// The example of the page: programs of iceoryx with a type, as they stand there.
#include <gmock/gmock.h>

#include <string>

#include "tests/gateway/iceoryx/scene.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

Spoken commander(const std::string& service, const std::string& forward) {
  return Spoken({ARBITER_TESTS "/example_iceoryx_commander", service, forward});
}

TEST_F(Iceoryx, TheExampleOfThePageDoesWhatThePageSays) {
  const Roudi roudi(directory_);
  daemon_.load(content_of(ARBITER_EXAMPLE "/model.xml"));
  const Spoken gate({ARBITER_PROGRAMS "/arbiter-gateway-iceoryx", ARBITER_EXAMPLE "/gateway.xml"});
  Spoken base({ARBITER_TESTS "/example_iceoryx_base"});
  EXPECT_TRUE(base.hear("speed 0"));
  Spoken planner = commander("Planner", "1");
  EXPECT_TRUE(base.hear("speed 1"));
  Spoken joystick = commander("Joystick", "0.3");
  EXPECT_TRUE(base.hear("speed 0.3"));
  joystick.process.signal(SIGINT);
  EXPECT_EQ(joystick.process.wait(), 0);
  EXPECT_TRUE(base.hear("speed 1"));
  planner.process.signal(SIGINT);
  EXPECT_EQ(planner.process.wait(), 0);
  EXPECT_TRUE(base.hear("speed 0"));
}

}  // namespace
}  // namespace arbiter::test
