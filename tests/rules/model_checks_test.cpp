// Checks of a whole model that need no proof. Limits have tests of their own.
#include "rules/model/model_checks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(ForeverCommands, ASourceThatCommandsForeverIsNoted) {
  const Loaded loaded = load_text(
      "<behaviors>\n<source port='/Lock:o' timeout='forever'/>\n"
      "<source port='/Hold/pos:o' timeout='forever'/>\n"
      "<behavior name='A'><config at='/p:i'>/Hold/pos:o</config>"
      "<config at='/q:i'>/Hold/pos:o</config><condition>not /Lock:o</condition></behavior>\n"
      "</behaviors>");
  EXPECT_THAT(loaded.findings(), ElementsAre("3:1 note forever-commands"));
  EXPECT_THAT(loaded.message(), HasSubstr("/Hold/pos:o commands /p:i and /q:i, and its T is "
                                          "forever: if its process is killed, "));
  EXPECT_THAT(loaded.message(), HasSubstr("; give it a finite T, or "));
}

TEST(ForeverCommands, SourcesThatHaveItByDefaultAreNotedTogether) {
  const Loaded loaded = load_text(
      "<behaviors timeout='forever'>\n<source port='/c:o' timeout='1s'/>\n"
      "<behavior name='A'><config at='/p:i'>/a:o</config></behavior>\n"
      "<behavior name='B'><config at='/q:i'>/b:o</config></behavior>\n"
      "<behavior name='C'><config at='/r:i'>/c:o</config></behavior>\n</behaviors>");
  EXPECT_THAT(loaded.findings(), ElementsAre("1:21 note forever-commands"));
  EXPECT_THAT(loaded.message(), HasSubstr("/a:o and /b:o command /p:i and /q:i, and their T is "));
}

}  // namespace
}  // namespace arbiter::rules
