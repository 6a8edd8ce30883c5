#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST(Check, SumsUpAModelThatIsFine) {
  TemporaryDirectory directory;
  const auto result = arbiter({"check", directory.write("m.xml", kOverrideModel)});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "ok: 1 port, 2 connections, 2 sources\n");
  EXPECT_EQ(result.err, "");
}

TEST(Check, TakesAModelInSeveralFilesBeforeAndAfterOptions) {
  TemporaryDirectory directory;
  const auto low = directory.write(
      "low.xml", R"(<behavior name="Low"><config at="/p">/low</config></behavior>)");
  const auto high = directory.write(
      "high.xml",
      R"(<behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition></behavior>)");
  const auto application =
      directory.write("app.xml",
                      "<application><connection><from>/low</from><to>/p</to></connection>"
                      "<connection><from>/high</from><to>/p</to></connection>"
                      "<connection><from>/other</from><to>/q</to></connection></application>");
  const auto result = arbiter({"check", low, "--application", application, high});
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(result.out, "ok: 2 ports, 3 connections, 3 sources\n");
  EXPECT_EQ(result.exit_code, 0);
}

TEST(Check, ExplainsAConflictWithItsWitness) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kConflictModel);
  const auto result = arbiter({"check", model});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, StartsWith(model + ":3:"));
  EXPECT_THAT(result.err, HasSubstr(": error: /b and /a (" + model + ":2:"));
  EXPECT_THAT(result.err, HasSubstr("[both-can-win]\n  active: /a, /b; inactive: /c\n1 error\n"));
}

TEST(Check, WritesTheSameAsJson) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kConflictModel);
  const auto result = arbiter({"check", "--json", model});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "");
  const auto found = nlohmann::json::parse(result.out);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0]["severity"], "error");
  EXPECT_EQ(found[0]["code"], "both-can-win");
  EXPECT_EQ(found[0]["file"], model);
  EXPECT_EQ(found[0]["line"], 3);
  EXPECT_EQ(found[0]["witness"], nlohmann::json::parse(R"({"active": ["/a", "/b"],
                                                           "inactive": ["/c"]})"));
}

TEST(Check, WritesAnEmptyArrayOfJsonIfNothingWasFound) {
  TemporaryDirectory directory;
  const auto result = arbiter({"check", directory.write("m.xml", kOverrideModel), "--json"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "[]\n");
  EXPECT_EQ(result.err, "");
}

TEST(Check, AWarningIsNoError) {
  TemporaryDirectory directory;
  const auto result = arbiter(
      {"check", directory.write(
                    "m.xml", R"(<arbiter at="/p"><select from="/a">not /a</select></arbiter>)")});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("warning: /a can never win at /p"));
  EXPECT_THAT(result.err, HasSubstr("[never-selected]\n1 warning\n"));
  EXPECT_EQ(result.out, "ok: 1 port, 1 connection, 1 source\n");
}

TEST(Check, ReportsMalformedFiles) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", "<behaviors>");
  const auto result = arbiter({"check", model});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr(model + ":1:"));
  EXPECT_THAT(result.err, HasSubstr("error: "));
}

}  // namespace
}  // namespace arbiter::test
