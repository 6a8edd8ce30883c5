// arbiter play: what a running daemon makes of a trace is what arbiter simulate says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

const std::string kPlayedModel = R"(<behaviors timeout="50ms">
  <source port="/stop" timeout="forever"/>
  <behavior name="Low"><config at="/p">/low</config><condition>not /stop</condition></behavior>
  <behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition></behavior>
  <arbiter at="/r" conflict="first">
    <select from="/high"/><select from="/low"/>
  </arbiter>
</behaviors>
)";
const std::string kApplication = R"(<application>
  <connection><from>/low</from><to>/p</to></connection>
  <connection><from>/high</from><to>/p</to></connection>
  <connection><from>/low</from><to>/r</to></connection>
  <connection><from>/high</from><to>/r</to></connection>
</application>
)";
// 51 ms: /high ends exactly then. A tick, a deactivation, and one that the model does not know.
const std::string kTrace =
    "t_ns,source,event\n0,/low,\n1000000,/high,\n2000000,/low,\n51000000,/low,\n52000000,,\n"
    "53000000,/stop,\n54000000,/low,\n55000000,/stop,deactivate\n56000000,/low,\n";

TEST(Play, DecidesAsSimulateSays) {
  Daemon daemon(kPlayedModel, {.application = kApplication});
  Node node("test");
  auto p = node.input_port("/p");
  auto r = node.input_port("/r");
  const TemporaryDirectory files;
  const auto trace = files.write("trace.csv", kTrace);
  const auto simulated = arbiter({"simulate", files.write("m.xml", kPlayedModel), "--application",
                                  files.write("a.xml", kApplication), "--trace", trace});
  ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
  EXPECT_THAT(simulated.out, HasSubstr("51000000,/low,/p,delivered,/low\n"));
  const auto played = arbiter({"play", trace});
  EXPECT_EQ(played.exit_code, 0) << played.err;
  EXPECT_EQ(played.err, "");
  EXPECT_EQ(played.out, simulated.out);
}

TEST(Play, SaysOfAPortThatNobodyHasOpenThatNothingIsDelivered) {
  Daemon daemon(kPlayedModel);
  Node node("test");
  auto r =
      node.input_port("/r", Type::variable("text", 64));  // of samples that play cannot make up
  const TemporaryDirectory files;
  const auto played = arbiter(
      {"play", files.write("trace.csv", "t_ns,source,event\n0,/low,\n1,/low,deactivate\n")});
  EXPECT_EQ(played.exit_code, 0);
  EXPECT_THAT(played.err, HasSubstr("arbiter: no component has /p open, which the model connects "
                                    "to /low, so that nothing is delivered there\n"));
  EXPECT_THAT(played.err, testing::Not(HasSubstr("no component has /r open")));
  EXPECT_EQ(played.out,
            "t_ns,source,destination,decision,winner\n"
            "0,/low,/p,not open,/low\n0,/low,/r,refused,/low\n"
            "1,/low,/p,-,-\n1,/low,/r,-,-\n");
}

// Of a command, all zeros are what a robot stands still by.
TEST(Play, SendsZerosOfTheTypeThatComponentsTake) {
  Daemon daemon(kPlayedModel);
  Node node("test");
  auto p = node.input_port<double>("/p");
  auto r = node.input_port("/r");
  const TemporaryDirectory files;
  const auto trace = files.write("trace.csv", "t_ns,source\n0,/low\n");
  const auto played = arbiter({"play", trace});
  EXPECT_EQ(played.exit_code, 0) << played.err;
  EXPECT_EQ(played.out,
            "t_ns,source,destination,decision,winner\n"
            "0,/low,/p,delivered,/low\n0,/low,/r,delivered,/low\n");
  const auto sample = p.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ(**sample, 0.0);
}

TEST(Play, ChoosesNoneOfSeveralTypes) {
  Daemon daemon(kPlayedModel);
  Node node("test");
  auto p = node.input_port<double>("/p");
  auto r = node.input_port<float>("/r");
  const TemporaryDirectory files;
  const auto played = arbiter({"play", files.write("trace.csv", "t_ns,source\n0,/low\n")});
  EXPECT_EQ(played.exit_code, 0);
  EXPECT_EQ(played.out,
            "t_ns,source,destination,decision,winner\n"
            "0,/low,/p,refused,/low\n0,/low,/r,refused,/low\n");
}

TEST(Play, SaysOfAFullQueueThatItRefusesAndWhere) {
  Daemon daemon(kPlayedModel);
  Node node("test");
  InputPortOptions options;
  options.depth = 1;
  options.when_full = WhenFull::refuse_new;
  auto p = node.input_port("/p", options);
  auto r = node.input_port("/r");
  const TemporaryDirectory files;
  const auto played =
      arbiter({"play", files.write("trace.csv", "t_ns,source\n0,/low\n1000,/low\n2000,/high\n")});
  EXPECT_EQ(played.exit_code, 0) << played.err;
  EXPECT_EQ(played.out,
            "t_ns,source,destination,decision,winner\n"
            "0,/low,/p,delivered,/low\n0,/low,/r,delivered,/low\n"
            "1000,/low,/p,refused,/low\n1000,/low,/r,delivered,/low\n"
            "2000,/high,/p,delivered,/high\n2000,/high,/r,delivered,/high\n");
}

TEST(Play, NeedsThePolicysTap) {
  const TemporaryDirectory files;
  const auto policy = files.write("policy", "deny everyone tap *\nallow everyone all\n");
  Daemon daemon(kPlayedModel, {.arguments = {"--policy", policy}});
  const auto played = arbiter({"play", files.write("trace.csv", "t_ns,source\n0,/low\n")});
  EXPECT_EQ(played.exit_code, 1);
  EXPECT_THAT(played.err, HasSubstr("may not tap"));
  EXPECT_EQ(played.out, "");
}

TEST(Play, NoticesThatAComponentOpensAPort) {
  Daemon daemon(kPlayedModel);
  const TemporaryDirectory files;
  std::string trace = "t_ns,source\n";
  for (int i = 0; i < 100'000; ++i) trace += std::to_string(i * 10'000'000LL) + ",/low\n";
  const auto out_path = files.write("out", "");
  const shm::FileDescriptor out(::open(out_path.c_str(), O_WRONLY | O_CLOEXEC));
  ChildProcess play({ARBITER_PROGRAMS "/arbiter", "play", files.write("trace.csv", trace)}, {},
                    {-1, out.get(), -1});
  const auto has = [&](const char* row) {
    return content_of(out_path).find(row) != std::string::npos;
  };
  await([&] { return has("/low,/p,not open,/low"); });
  Node node("test");
  auto p = node.input_port("/p");
  await([&] { return has("/low,/p,delivered,/low"); });
  play.signal(SIGINT);
  EXPECT_EQ(play.wait(), 128 + SIGINT);
}

// As a shell says of a program that a signal has ended.
TEST(Play, ThatIsStoppedBeforeItsEndSaysBySoMuchOfItsSignal) {
  Daemon daemon(kPlayedModel);
  const TemporaryDirectory files;
  const auto trace = files.write("trace.csv", "t_ns,source\n0,/low\n3600000000000,/low\n");
  for (const int signal : {SIGINT, SIGTERM}) {
    ChildProcess play({ARBITER_PROGRAMS "/arbiter", "play", trace}, {}, {});
    await([&] { return daemon.source("/low")["component"]["pid"] == play.pid(); });
    play.signal(signal);
    EXPECT_EQ(play.wait(), 128 + signal);
  }
}

TEST(Play, RefusesWhatWouldNotEnd) {
  Daemon daemon(kPlayedModel);
  const TemporaryDirectory files;
  const auto trace = files.write("trace.csv", "t_ns,source\n0,/low\n1000000000000000000,/low\n");
  const auto result = arbiter({"play", trace, "--speed", "0.001"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, testing::HasSubstr("would take more than 70 years at this speed"));
}

TEST(Play, NotesSourcesThatTheModelDoesNotKnow) {
  Daemon daemon(kPlayedModel);
  const TemporaryDirectory files;
  const auto played = arbiter({"play", files.write("trace.csv", "t_ns,source\n0,/hgih\n")});
  EXPECT_EQ(played.exit_code, 0);
  EXPECT_THAT(played.err, HasSubstr("note: the daemon's model does not know /hgih"));
  EXPECT_EQ(played.out, "t_ns,source,destination,decision,winner\n");
}

}  // namespace
}  // namespace arbiter::test
