// `arbiter check --assert`: statements that are proved, refuted or cannot be read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

TEST(Check, StatementsThatAreTrueAreProved) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  const auto statements = directory.write("s.txt", "/object -> winner(/arm) != /rest\n");
  const auto result =
      arbiter({"check", model, "--assert", statements, "--silence", "nobody-wins,starved"});
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(result.out,
            "1 statement: 1 proved, 0 refuted, 0 left open\n"
            "ok: 1 port, 2 connections, 3 sources\n");
  EXPECT_EQ(result.exit_code, 0);
}

TEST(Check, ProvedStatementsQuietWhatTheyCover) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  const auto statements = directory.write("s.txt", "/object and /collision -> idle(/arm)\n");
  const auto result = arbiter({"check", model, "--assert", statements});
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(result.exit_code, 0);
}

TEST(Check, AStatementThatIsNotTrueEndsWithOneAndSaysWhen) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  const auto statements = directory.write("s.txt", "# stop\n  /collision ->\n  idle(/arm)\n");
  const auto more = directory.write("t.txt", "/object or not /object\n");
  const std::vector<std::string> command = {"check",    model, "--assert",  statements,
                                            "--assert", more,  "--silence", "nobody-wins,starved"};
  auto result = arbiter(command);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err,
              StartsWith(statements + ":2:3: error: this is false with /collision and /rest active "
                                      "and /object inactive, whatever else is; /rest wins at /arm "
                                      "if nothing else is active; "));
  EXPECT_THAT(result.err, HasSubstr("[refuted]\n    2 |   /collision ->\n      |   ^\n1 error\n"));
  EXPECT_EQ(result.out, "2 statements: 1 proved, 1 refuted, 0 left open\nfailed: 1 error\n");
  auto with_json = command;
  with_json.push_back("--json");
  result = arbiter(with_json);
  EXPECT_EQ(result.exit_code, 1);
  const auto found = nlohmann::json::parse(result.out);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0]["code"], "refuted");
  EXPECT_EQ(found[0]["witness"]["active"], (std::vector<std::string>{"/collision", "/rest"}));
  EXPECT_EQ(found[1]["code"], "proved");
  EXPECT_EQ(found[1]["severity"], "note");
}

TEST(Check, StatementsAreReadEvenIfTheModelHasErrors) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kConflictModel);
  const auto statements = directory.write("s.txt", "/a and\n");
  const auto result = arbiter({"check", model, "--assert", statements});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("[both-can-win]"));
  EXPECT_THAT(result.err, HasSubstr(statements + ":1:7: error: the statement ends where"));
  EXPECT_THAT(result.err, HasSubstr("were not checked, because the model has errors [left-open]"));
  EXPECT_EQ(result.out, "failed: 2 errors, 1 note\n");
}

TEST(Check, AFileWithoutStatementsIsAnErrorForItProvesNothing) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  for (const std::string text : {"", "\n", "# later\n  \n# more"}) {
    const auto statements = directory.write("s.txt", text);
    const auto result = arbiter({"check", model, "--assert", statements});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, HasSubstr(statements + ":1:1: error: this file has no statement"));
    EXPECT_THAT(result.out, EndsWith("failed: 1 error, 2 notes\n"));
  }
}

TEST(Check, StatementsThatCannotBeReadAreCountedToo) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  const auto statements =
      directory.write("s.txt", "/object or\nidle(/nowhere)\n/object or not /object\n)\n");
  const auto result = arbiter({"check", model, "--assert", statements});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, StartsWith("4 statements: 1 proved, 0 refuted, 0 left open, 3 could not "
                                     "be read\n"));
}

TEST(Check, ARefutedStatementIsToldBehindAnyNumberOfTrueOnes) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  std::string text;
  for (int i = 0; i < 9'999; ++i) text += "/object or not /object\n";
  const auto statements = directory.write("s.txt", text + "/collision -> idle(/arm)\n");
  const auto more = directory.write("t.txt", "/rest or not /rest\n/rest or not /rest\n");
  const auto result = arbiter({"check", model, "--assert", statements, "--assert", more, "--json"});
  EXPECT_EQ(result.exit_code, 1);
  const auto found = nlohmann::json::parse(result.out);
  EXPECT_EQ(found.front()["code"], "refuted");
  EXPECT_EQ(found.back()["code"], "not-listed");
  EXPECT_EQ(found.back()["code_omitted"], "proved");
  EXPECT_EQ(found.back()["count"], 1);
}

TEST(Check, StatementsThatCannotBeOpenedAreWrongUse) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  EXPECT_EQ(arbiter({"check", model, "--assert", directory.path() + "/none"}).exit_code, 2);
}

}  // namespace
}  // namespace arbiter::test
