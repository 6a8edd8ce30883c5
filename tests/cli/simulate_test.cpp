#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

class Simulate : public testing::Test {
 protected:
  ProgramResult simulate(const std::string& trace) {
    trace_ = directory_.write("trace.csv", trace);
    return arbiter({"simulate", directory_.write("m.xml", model_), "--trace", trace_});
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

}  // namespace
}  // namespace arbiter::test
