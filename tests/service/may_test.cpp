// kMay: a program that lets others look through it asks what they may.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/daemon.hpp"
#include "tests/support/listener.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

class MayQuestion : public testing::Test {
 protected:
  MayQuestion() { client_.hello(); }

  // "yes", or why not.
  std::string may(std::uint32_t user, const std::string& groups,
                  const std::string& action = "observe") {
    auto question = RawClient::message(wire::MessageKind::kMay, action);
    question.value = user;
    question.set_text(groups);
    if (client_.ask(question) == Words{"kDone"}) return "yes";
    return std::string(client_.last_answer().text_view());
  }

  const TemporaryDirectory files_;
  Daemon daemon_{
      kNoRules,
      {.arguments = {"--policy", files_.write("policy",
                                              "deny group 4005 observe\nallow user 4001 observe\n"
                                              "allow group 4002 switch\n")}}};
  Listener client_{daemon_};
};

TEST_F(MayQuestion, IsAnsweredByThePolicyForThatUserAndThoseGroups) {
  EXPECT_EQ(may(4001, ""), "yes");
  EXPECT_EQ(may(4001, "4001 4002"), "yes");
  EXPECT_THAT(may(4001, "4001 4005"), HasSubstr("user 4001 may not observe"));
  EXPECT_THAT(may(4001, "4005 4001"), HasSubstr("deny group 4005 observe"));
  EXPECT_THAT(may(4003, "4003"), HasSubstr("user 4003 may not observe"));
  EXPECT_EQ(may(4003, "4003 4002", "switch"), "yes");
  EXPECT_THAT(may(4003, "4003", "switch"), HasSubstr("may not switch to another model"));
  EXPECT_EQ(may(0, "0", "stop"), "yes");
}

TEST_F(MayQuestion, ThatIsNoneIsRefused) {
  for (const char* const groups : {"x", "4001,4002", " 4001", "4001  4002", "-1", "99999999999"}) {
    EXPECT_THAT(may(4001, groups), HasSubstr("numbers between blanks")) << groups;
  }
  EXPECT_THAT(may(4001, "", "fly"), HasSubstr("there is no action \"fly\""));
  EXPECT_THAT(may(4001, "", "output"), HasSubstr("there is no action \"output\""))
      << "what is about a port is asked with the port";
  EXPECT_THAT(may(4001, "", "a\nb"), HasSubstr("\\n"));
}

}  // namespace
}  // namespace arbiter::test
