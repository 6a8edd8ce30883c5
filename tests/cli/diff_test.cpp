#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class Diff : public testing::Test {
 protected:
  const std::string low_ = R"(<behavior name="Low"><config at="/p">/low</config></behavior>)";
  const std::string high_ =
      R"(<behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition></behavior>)";
  TemporaryDirectory directory_;
};

TEST_F(Diff, AnotherOrderIsNoDifferenceAndEndsWithZero) {
  const auto result = arbiter(
      {"diff", directory_.write("a.xml", low_ + high_), directory_.write("b.xml", high_ + low_)});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "no difference: 1 port decides alike in every state\n");
  EXPECT_EQ(result.err, "");
}

TEST_F(Diff, ADifferenceEndsWithOne) {
  const auto before = directory_.write("a.xml", low_ + high_);
  const auto after =
      directory_.write("b.xml", low_ +
                                    "<source port=\"/high\" timeout=\"2s\"/>"
                                    R"(<behavior name="High"><config at="/p">/high</config>
                         <condition>not /stop</condition><inhibition>Low</inhibition></behavior>)");
  const auto result = arbiter({"diff", before, after});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out,
            "timeout of /high: 500ms -> 2s\n"
            "/p\n"
            "  read only after: /stop\n"
            "  decides differently in 2 of 2^3 = 8 states\n"
            "  /high -> nobody: 2 states, such as with /high and /stop active\n"
            "1 of 1 port decides differently (/p); 1 timeout changed\n");
  const auto json = nlohmann::json::parse(arbiter({"diff", "--json", before, after}).out);
  EXPECT_EQ(json["differs"], true);
  EXPECT_EQ(json["ports"][0]["states"], "2");
}

TEST_F(Diff, AModelWithErrorsEndsWithTwoAndSaysWhich) {
  const auto fine = directory_.write("a.xml", low_ + high_);
  const auto bad = directory_.write("bad.xml", "<behaviors>");
  const auto result = arbiter({"diff", fine, bad});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, StartsWith(bad + ":1:"));
  EXPECT_EQ(arbiter({"diff", fine, directory_.path() + "/none.xml"}).exit_code, 2);
  EXPECT_EQ(arbiter({"diff", fine}).exit_code, 2);
}

TEST_F(Diff, AModelMayHaveSeveralFiles) {
  const auto both = directory_.write("both.xml", low_ + high_);
  const auto low = directory_.write("low.xml", low_), high = directory_.write("high.xml", high_);
  EXPECT_EQ(arbiter({"diff", both, low + "," + high}).exit_code, 0);
  EXPECT_EQ(arbiter({"diff", both, low}).exit_code, 1);
}

// With 1 it would say that they differ.
TEST_F(Diff, AModelMayHaveFilesWhoseNamesTogetherAreNoName) {
  directory_.write("both.xml", low_ + high_);
  const std::string low = std::string(150, 'l'), high = std::string(150, 'h');
  directory_.write(low, low_);
  directory_.write(high, high_);
  const auto result =
      run_program({"/usr/bin/env", "-C", directory_.path(), ARBITER_PROGRAMS "/arbiter", "diff",
                   "both.xml", low + "," + high});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(Diff, EachModelMayHaveItsApplication) {
  const auto model = directory_.write("m.xml", low_);
  const auto connection = [](const std::string& source) {
    return "<connection><from>" + source + "</from><to>/p</to></connection>";
  };
  const auto before =
      directory_.write("before.xml", "<application>" + connection("/low") + "</application>");
  const auto after = directory_.write(
      "after.xml", "<application>" + connection("/low") + connection("/x") + "</application>");
  EXPECT_EQ(arbiter({"diff", model, model, "--application", before}).exit_code, 0);
  const auto result =
      arbiter({"diff", model, model, "--application-before", before, "--application-after", after});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("connected only after: /x"));
}

}  // namespace
}  // namespace arbiter::test
