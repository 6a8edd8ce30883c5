#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

TEST(Rules, AreShownAsThePaperWritesThem) {
  TemporaryDirectory directory;
  const auto result = arbiter({"rules", directory.write("m.xml", kOverrideModel)});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(result.out,
            "/p\n"
            "  /low ∧ ¬/high ⇒ Select(/low)\n"
            "  /high ⇒ Select(/high)\n");
}

TEST(Rules, ThatContradictEachOtherAreShownAsWell) {
  TemporaryDirectory directory;
  const auto result = arbiter({"rules", directory.write("m.xml", kConflictModel)});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out,
            "/p\n"
            "  /a ⇒ Select(/a)\n"
            "  /b ∧ ¬/c ⇒ Select(/b)\n");
}

TEST(Rules, AreNotShownOfAModelThatCannotBeRead) {
  TemporaryDirectory directory;
  const auto result = arbiter({"rules", directory.write("m.xml", "<behaviors>")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr("error: "));
}

TEST(Rules, ComeAsJsonToo) {
  TemporaryDirectory directory;
  const auto result = arbiter({"rules", "--json", directory.write("m.xml", kOverrideModel)});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(nlohmann::json::parse(result.out), nlohmann::json::parse(R"({
    "timeout": "500ms", "timeouts": {}, "ports": [
      {"port": "/p", "arbitrated": true, "conflict": "error", "connections": [
        {"source": "/low", "rule": "/low ∧ ¬/high", "behaviours": ["Low"]},
        {"source": "/high", "rule": "/high", "behaviours": ["High"]}]}]})"));
}

TEST(Rules, ReadBackAsConditionsOfTheSameRules) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", R"(<behaviors>
    <arbiter at="/p"><select from="/a">not (/b iff /c) xor "/größe,2" or any(/x*) implies all(/x*)
      and none(/y*)</select></arbiter>
    <source port="/x1"/> <source port="/x2"/> <source port="/y1"/>
  </behaviors>)");
  const auto rule_of = [](const std::string& file) {
    const auto result = arbiter({"rules", "--json", file});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const auto parsed = nlohmann::json::parse(result.out);
    return parsed["ports"][0]["connections"][0]["rule"].get<std::string>();
  };
  const std::string once = rule_of(model);
  const auto again =
      directory.write("again.xml", R"(<arbiter at="/p"><select from="/a"><![CDATA[)" + once +
                                       "]]></select></arbiter>");
  EXPECT_EQ(rule_of(again), once);
}

}  // namespace
}  // namespace arbiter::test
