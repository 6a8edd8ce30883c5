// arbiter doctor, as it is run by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include <nlohmann/json.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

// Directories that every user's clients look into may hold anything.
const std::string kOfTheMachine = "stale-socket,strangers-directory";

ProgramResult doctor(const TemporaryDirectory& root, std::vector<std::string> more = {}) {
  more.insert(more.begin(), {"doctor", "--root", root.path(), "--silence", kOfTheMachine});
  return arbiter(more);
}

// Of a machine on which the daemon runs, and nothing else is known.
void add_process(const TemporaryDirectory& root, Daemon& daemon) {
  std::filesystem::create_directories(root.path() + "/proc/" +
                                      std::to_string(daemon.process().pid()));
}

TEST(DoctorProgram, FindsNothing) {
  const TemporaryDirectory root;
  Daemon daemon;
  add_process(root, daemon);
  const auto result = doctor(root);
  EXPECT_EQ(result.exit_code, 0) << result.out;
  EXPECT_THAT(result.out, HasSubstr("nothing found"));
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(json::parse(doctor(root, {"--json"}).out),
            (json{{"instance", "test"}, {"findings", json::array()}}));
}

TEST(DoctorProgram, SaysWhatIsWrongWhyItMattersAndHowToMendIt) {
  const TemporaryDirectory root;
  std::filesystem::create_directories(root.path() + "/proc");
  root.write("proc/meminfo", "MemAvailable: 1000 kB\n");
  Daemon daemon;
  add_process(root, daemon);
  auto result = doctor(root);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("the machine has 1000 KiB of memory left  [memory]\n  why:  "));
  EXPECT_THAT(result.out, HasSubstr("\n  mend: ps -eo"));
  EXPECT_THAT(result.out, HasSubstr("1 finding"));
  result = doctor(root, {"--json"});
  EXPECT_EQ(result.exit_code, 1);
  const json findings = json::parse(result.out)["findings"];
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0]["code"], "memory");
  for (const char* field : {"what", "why", "mend"}) {
    EXPECT_NE(findings[0][field].get<std::string>(), "") << field;
  }
  result = doctor(root, {"--silence", "memory"});
  EXPECT_EQ(result.exit_code, 0) << result.out;
  EXPECT_THAT(result.out, HasSubstr("nothing found; silenced: "));
}

TEST(DoctorProgram, FindsThatThereIsNoDaemon) {
  const TemporaryDirectory root;
  const auto result = doctor(root, {"--instance", "nobody-has-this-instance"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("[no-daemon]"));
}

TEST(DoctorProgram, SaysThatNoDaemonRunsOnTheMachineOfAnEmptyRoot) {
  const TemporaryDirectory root;
  Daemon daemon;
  const auto result = doctor(root);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("no daemon runs on the machine of --root"));
  EXPECT_THAT(result.out, HasSubstr("[no-daemon]"));
}

// 250 ms is more than its T.
TEST(DoctorProgram, SaysWhichPublisherIsSlowerThanItsT) {
  Daemon daemon(R"(<behaviors timeout="1s"><source port="/slow" timeout="100ms"/>
    <source port="/unread" timeout="100ms"/>
    <behavior name="A"><config at="/p">/slow</config></behavior>
    <behavior name="B"><config at="/q">/quick</config></behavior></behaviors>)");
  const ChildProcess slow({ARBITER_PROGRAMS "/arbiter", "pub", "/slow", "--rate", "4"}, {}, {});
  const ChildProcess quick({ARBITER_PROGRAMS "/arbiter", "pub", "/quick", "--rate", "20"}, {}, {});
  const ChildProcess unread({ARBITER_PROGRAMS "/arbiter", "pub", "/unread", "--rate", "4"}, {}, {});
  await([&] { return daemon.source("/unread")["open"] == true; });
  std::string out;
  // Where the machine is busy, two periods may differ too much.
  while (out.find("[slow-publisher]") == std::string::npos) {
    out = arbiter({"doctor", "--silence", kOfTheMachine}).out;
  }
  EXPECT_THAT(out, testing::ContainsRegex("/slow publishes every [0-9]+ ms, and its T is 100 ms"));
  EXPECT_THAT(out, HasSubstr("(arbiter-pub, pid " + std::to_string(slow.pid()) + ")"));
  EXPECT_THAT(out, HasSubstr("<source port=\"/slow\" timeout="));
  EXPECT_THAT(out, testing::Not(HasSubstr("/quick publishes")));
  EXPECT_THAT(out, testing::Not(HasSubstr("/unread publishes"))) << "no rule reads or selects it";
}

TEST(DoctorProgram, RefusesWhatItCannotLookAt) {
  EXPECT_EQ(arbiter({"doctor", "--root", "/nowhere"}).exit_code, 2);
  EXPECT_EQ(arbiter({"doctor", "--silence", "nonsense"}).exit_code, 2);
  EXPECT_EQ(arbiter({"doctor", "--instance", "no/name"}).exit_code, 2);
}

}  // namespace
}  // namespace arbiter::test
