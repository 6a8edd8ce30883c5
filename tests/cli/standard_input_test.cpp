// What "-" stands for, and that only one file can be standard input.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class StandardInput : public testing::Test {
 protected:
  static ProgramResult arbiter_with(std::vector<std::string> arguments, const std::string& input) {
    arguments.insert(arguments.begin(), std::string(ARBITER_PROGRAMS) + "/arbiter");
    return run_program(arguments, input);
  }

  const std::string low_ = R"(<behavior name="Low"><config at="/p">/low</config></behavior>)";
  const std::string high_ =
      R"(<behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition></behavior>)";
  TemporaryDirectory directory_;
  const std::string model_ = directory_.write("model.xml", low_ + high_);
};

TEST_F(StandardInput, MayBeAnyFileThatAVerbReads) {
  const std::string ok = "ok: 1 port, 2 connections, 2 sources\n";
  EXPECT_EQ(arbiter_with({"check", "-"}, low_ + high_).out, ok);
  EXPECT_EQ(arbiter_with({"check", directory_.write("low.xml", low_), "-"}, high_).out, ok);
  EXPECT_EQ(arbiter_with({"check", model_, "--assert", "-"}, "/high -> winner(/p) = /high\n").out,
            "1 statement: 1 proved, 0 refuted, 0 left open\n" + ok);
  for (const char* option : {"--application", "--hosts"}) {
    EXPECT_THAT(arbiter_with({"check", model_, option, "-"}, "<applicatio/>").err,
                StartsWith("/dev/stdin:1:1: error: the root of an application"));
  }
  EXPECT_THAT(arbiter_with({"check", model_, "--gateway", "-"}, "<gateway").err,
              StartsWith("/dev/stdin:1:"));
  const std::string trace = "t_ns,source\n0,/low\n";
  EXPECT_THAT(arbiter_with({"simulate", model_, "--trace", "-"}, trace).out, HasSubstr("\n0,/low"));
  EXPECT_EQ(arbiter_with({"diff", "-,low.xml", model_}, high_).err,
            "arbiter: cannot open low.xml: No such file or directory\n");
  EXPECT_EQ(arbiter_with({"diff", "-," + directory_.write("low.xml", low_), model_}, high_).out,
            "no difference: 1 port decides alike in every state\n");
  EXPECT_THAT(arbiter_with({"diff", model_, model_, "--application-after", "-"}, "<a/>").err,
              StartsWith("/dev/stdin:1:1: error"));
  EXPECT_EQ(arbiter_with({"import", "twist_mux", "-"}, "x: 1\n").err.find("cannot open"),
            std::string::npos);
}

TEST_F(StandardInput, IsReadOnce) {
  const std::string already =
      ": standard input is read for another file already, and only once; give this one by name\n";
  const auto error = [&](const std::vector<std::string>& arguments) {
    const auto result = arbiter_with(arguments, low_ + high_);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.out, "");
    return result.err.substr(0, result.err.find('\n') + 1);
  };
  EXPECT_EQ(error({"check", "-", "-"}), "MODEL" + already);
  EXPECT_EQ(error({"check", "-", "/dev/stdin"}), "MODEL" + already);
  EXPECT_EQ(error({"diff", "-", "-"}), "AFTER" + already);
  EXPECT_EQ(error({"diff", "-,-", model_}), "BEFORE" + already);
  EXPECT_THAT(error({"check", "-", "--assert", "-"}), HasSubstr(already));
  EXPECT_THAT(error({"simulate", "-", "--trace", "-"}), HasSubstr(already));
  for (const char* input : {"-", "/dev/stdin"}) {
    EXPECT_EQ(error({"diff", model_, model_, "--application", input}),
              "--application: this is read for each of the two models, and standard input only "
              "once; give a file by name\n");
  }
}

}  // namespace
}  // namespace arbiter::test
