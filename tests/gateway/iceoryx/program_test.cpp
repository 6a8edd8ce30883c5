// The program around a gateway: options, mappings that are wrong, exit codes. Without RouDi.
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <fstream>
#include <string>
#include <vector>

#include "tests/support/run_program.hpp"
#include "tests/support/spoken.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

ProgramResult run_gateway(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), ARBITER_PROGRAMS "/arbiter-gateway-iceoryx");
  return run_program(arguments, {});
}

constexpr const char* kGood =
    "<gateway kind='iceoryx'><in service='a' instance='b' event='c' port='/p:o'/></gateway>";

TEST(GatewayProgram, ChecksItsMappingAndEnds) {
  const TemporaryDirectory directory;
  const auto good = run_gateway({directory.write("good.xml", kGood), "--check"});
  EXPECT_EQ(good.exit_code, 0) << good.err;
  EXPECT_EQ(good.out, "ok: 1 entry\n");
}

TEST(GatewayProgram, RefusesAMappingWithErrorsAndSaysWhere) {
  const TemporaryDirectory directory;
  const auto wrong = run_gateway({directory.write(
      "wrong.xml",
      "<gateway kind='iceoryx'>\n<in service='a' instance='b' port='/p:o'/></gateway>")});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("wrong.xml:2:1: error: <in> lacks the attribute event"));
  const std::string good = directory.write("good.xml", kGood);
  const auto twice = run_gateway({good, good});
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_THAT(twice.err, HasSubstr("has an entry already"));
}

TEST(GatewayProgram, RefusesAMappingThatHasNothingForIt) {
  const TemporaryDirectory directory;
  const auto none = run_gateway({directory.write("dds.xml", "<gateway kind='dds'/>"), "--check"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("there is no <in> and no <out> of a <gateway kind=\"iceoryx\">"));
}

TEST(GatewayProgram, SaysWhatIsWrongWithItsArguments) {
  EXPECT_EQ(run_gateway({}).exit_code, 2);
  const auto misspelt = run_gateway({"--isntance", "x"});
  EXPECT_EQ(misspelt.exit_code, 2);
  EXPECT_THAT(misspelt.err,
              HasSubstr("has no option \"--isntance\"; did you mean \"--instance\"?"));
  const auto none = run_gateway({"/no/such/file.xml"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("/no/such/file.xml"));
  const TemporaryDirectory directory;
  const auto instance = run_gateway({directory.write("good.xml", kGood), "--instance", "../x"});
  EXPECT_EQ(instance.exit_code, 2);
  EXPECT_THAT(instance.err, HasSubstr("\"../x\" is not a name for an instance"));
  const auto help = run_gateway({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("Exit codes: 0"));
}

// As where the terminal closes in which it was started.
TEST(GatewayProgram, EndsInGoodOrderAtAHangup) {
  const TemporaryDirectory directory;
  ::signal(SIGHUP, SIG_DFL);  // what a test was started with, the program has too
  const std::string instance = "none-" + std::to_string(::getpid());
  Spoken gateway({ARBITER_PROGRAMS "/arbiter-gateway-iceoryx", "--instance", instance,
                  directory.write("good.xml", kGood)});
  ASSERT_TRUE(gateway.hear("no arbiterd of instance \"" + instance)) << gateway.heard;
  gateway.process.signal(SIGHUP);
  EXPECT_EQ(gateway.process.wait(), 0);
}

TEST(GatewayProgram, GoesOnAfterAHangupThatIsIgnored) {
  const TemporaryDirectory directory;
  ::signal(SIGHUP, SIG_IGN);  // as nohup does
  const std::string instance = "none-" + std::to_string(::getpid());
  Spoken gateway({ARBITER_PROGRAMS "/arbiter-gateway-iceoryx", "--instance", instance,
                  directory.write("good.xml", kGood)});
  ::signal(SIGHUP, SIG_DFL);
  ASSERT_TRUE(gateway.hear("no arbiterd of instance \"" + instance)) << gateway.heard;
  gateway.process.signal(SIGHUP);
  const std::string pid = std::to_string(gateway.process.pid());
  pid_t worker = 0;
  std::ifstream("/proc/" + pid + "/task/" + pid + "/children") >> worker;
  ASSERT_GT(worker, 0);
  ::kill(worker, SIGKILL);
  EXPECT_TRUE(gateway.hear("another one is started")) << gateway.heard;
}

// Its worker is given the same words, and one of its own.
TEST(GatewayProgram, AMappingMayFollowADoubleDash) {
  const TemporaryDirectory directory;
  const std::string instance = "none-" + std::to_string(::getpid());
  Spoken gateway({ARBITER_PROGRAMS "/arbiter-gateway-iceoryx", "--instance", instance, "--",
                  directory.write("good.xml", kGood)});
  EXPECT_TRUE(gateway.hear("no arbiterd of instance \"" + instance)) << gateway.heard;
}

}  // namespace
}  // namespace arbiter::test
