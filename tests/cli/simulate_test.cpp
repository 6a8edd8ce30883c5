#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class Simulate : public testing::Test {
 protected:
  ProgramResult simulate(const std::string& trace, const std::vector<std::string>& more = {}) {
    trace_ = directory_.write("trace.csv", trace);
    std::vector<std::string> arguments = {"simulate", directory_.write("m.xml", model_), "--trace",
                                          trace_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arbiter(arguments);
  }

  TemporaryDirectory directory_;
  std::string model_ = kOverrideModel;
  std::string trace_;
};

TEST_F(Simulate, WritesOneRowForEachPortThatAnArrivalConcerns) {
  const auto result = simulate("t_ns,source\n0,/low\n1,/high\n2,/low\n500000001,/low\n");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(result.out,
            "t_ns,source,destination,decision,winner\n"
            "0,/low,/p,delivered,/low\n"
            "1,/high,/p,delivered,/high\n"
            "2,/low,/p,discarded,/high\n"
            "500000001,/low,/p,delivered,/low\n");
}

TEST_F(Simulate, WritesOnlyAHeaderForATraceWithoutEvents) {
  const auto result = simulate("t_ns,source\n");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "t_ns,source,destination,decision,winner\n");
}

TEST_F(Simulate, ShowsTicksAndDeactivations) {
  const auto result = simulate("t_ns,source,event\r\n0,/high,\r\n1,,\r\n2,/high,deactivate\r\n");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out,
            "t_ns,source,destination,decision,winner\n"
            "0,/high,/p,delivered,/high\n"
            "1,-,/p,-,/high\n"
            "2,/high,/p,-,-\n");
}

TEST_F(Simulate, NotesAnUnknownSourceOnce) {
  const auto result = simulate("t_ns,source\n0,/who\n1,/who\n2,/low\n");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "t_ns,source,destination,decision,winner\n2,/low,/p,delivered,/low\n");
  EXPECT_EQ(result.err, trace_ +
                            ":2:3: note: the model does not know /who; its arrivals have no effect "
                            "[unknown-source]\n    2 | 0,/who\n      |   ^\n1 note\n");
}

TEST_F(Simulate, SaysOfAnInputPortThatItIsNoSource) {
  EXPECT_THAT(
      simulate("t_ns,source\n0,/p\n").err,
      HasSubstr("no effect; it is an input port: name who publishes there [unknown-source]"));
  EXPECT_THAT(simulate("t_ns,source\n0,low\n").err, HasSubstr("no effect; did you mean \"/low\"?"));
}

TEST_F(Simulate, WritesNoResultOfABadTrace) {
  const auto result = simulate("t_ns,source\n0,/low\nbad,/low\n5,/low,arrive\n4,/low\n3,/low\n");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr(trace_ + ":3:1: error: "));
  EXPECT_THAT(result.err, HasSubstr(trace_ + ":4:8: error: "));
  EXPECT_THAT(result.err, HasSubstr(trace_ + ":6:1: error: "));
  EXPECT_THAT(result.err, HasSubstr("\n3 errors\n"));
}

TEST_F(Simulate, WritesNoResultOfABadModelAndReportsTheTraceAsWell) {
  model_ = kConflictModel;
  const auto result = simulate("t_ns,source\nbad,/a\n");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr("[both-can-win]"));
  EXPECT_THAT(result.err, HasSubstr("[trace-time]"));
}

TEST_F(Simulate, PassesOnTheModelsWarnings) {
  model_ = R"(<arbiter at="/p"><select from="/a">not /a</select></arbiter>)";
  const auto result = simulate("t_ns,source\n0,/a\n");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "t_ns,source,destination,decision,winner\n0,/a,/p,discarded,-\n");
  EXPECT_THAT(result.err, HasSubstr("[never-selected]"));
}

TEST_F(Simulate, ExplainsInsteadWithWhy) {
  const auto result =
      simulate("t_ns,source,event\n0,/low,\n1,/high,\n2,/low,\n3,/high,deactivate\n", {"--why"});
  EXPECT_EQ(result.exit_code, 0);
  const std::string inhibited =
      "inhibited by behaviour \"High\" (" + directory_.path() + "/m.xml:3): ";
  EXPECT_EQ(result.out,
            "0.000 s  /p  idle -> /low  because /low became active\n"
            "0.000000001 s  /p  /low -> /high  because /high became active; /low is " +
                inhibited +
                "/high is active (arrived just now, T 500ms)\n"
                "0.000000002 s  /p  /low discarded: " +
                inhibited +
                "/high is active (arrived 0 us ago, T 500ms)\n"
                "0.000000003 s  /p  /high -> /low  because /high was deactivated\n");
}

// A publisher of 100 Hz would fill the screen; what keeps it out is the same each time.
TEST_F(Simulate, CountsWhatIsDiscardedAgainForTheSameReason) {
  const auto result = simulate(
      "t_ns,source,event\n0,/high,\n1000,/low,\n2000,/low,\n3000,/low,\n4000,/high,deactivate\n"
      "5000,/high,\n6000,/low,\n7000,/low,\n",
      {"--why"});
  std::vector<std::string> lines;
  std::istringstream text(result.out);
  for (std::string line; std::getline(text, line);) {
    if (line.find("discarded") != std::string::npos) lines.push_back(line);
  }
  ASSERT_EQ(lines.size(), 4u) << result.out;
  EXPECT_THAT(lines[0], StartsWith("0.000001 s  /p  /low discarded: inhibited by behaviour "));
  EXPECT_EQ(lines[1],
            "0.000004 s  /p  /low was discarded 2 more times for that reason, until 0.000003 s");
  EXPECT_THAT(lines[2], StartsWith("0.000006 s  /p  /low discarded: inhibited by behaviour "));
  EXPECT_EQ(lines[3],
            "0.000007 s  /p  /low was discarded 1 more time for that reason, until 0.000007 s");
}

// The port is behind '=', or there is none.
TEST_F(Simulate, TakesTheModelBehindWhy) {
  const auto explained = simulate("t_ns,source\n0,/low\n", {"--why"});
  ASSERT_EQ(explained.exit_code, 0);
  const auto model = directory_.write("m.xml", model_);
  EXPECT_EQ(arbiter({"simulate", "--trace", trace_, "--why", model}).out, explained.out);
  const auto port = arbiter({"simulate", model, "--trace", trace_, "--why", "/p"});
  EXPECT_EQ(port.exit_code, 2);
  EXPECT_EQ(port.err, "arbiter: there is no file /p; if it is the port: --why=/p\n");
}

TEST_F(Simulate, SuggestsTheSourceThatWasMeant) {
  EXPECT_THAT(simulate("t_ns,source\n0,/hihg\n").err, HasSubstr("did you mean \"/high\"?"));
}

TEST_F(Simulate, ExplainsAsJsonToo) {
  const auto result = simulate("t_ns,source\n0,/low\n1,/high\n2,/low\n", {"--why=/p", "--json"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr(R"("event":"change")"));
  EXPECT_THAT(result.out, HasSubstr(R"("reason":[{"active":true,"source":"/high"}])"));
  EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 3);
}

TEST_F(Simulate, RefusesToExplainAPortThatThereIsNot) {
  const auto result = simulate("t_ns,source\n0,/low\n", {"--why=/q"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr("the model has no input port /q"));
  EXPECT_THAT(simulate("t_ns,source\n0,/low\n", {"--why=/low"}).err,
              HasSubstr("/low is an output port, connected to /p; give the input port first: "
                        "--why=/p\n"));
  EXPECT_THAT(simulate("t_ns,source\n0,/low\n", {"--why=/hihg"}).err,
              HasSubstr("the model has no input port /hihg; did you mean the output port "
                        "\"/high\", connected to /p? Then give the input port first: --why=/p\n"));
  EXPECT_EQ(simulate("t_ns,source\n", {"--json"}).exit_code, 2);
}

}  // namespace
}  // namespace arbiter::test
