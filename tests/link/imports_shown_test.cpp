// Where a source comes from: what the tool shows of imports, live and in recordings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include "tests/link/known_hosts.hpp"
#include "tests/link/robot.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

class ShownImports : public LoopbackHosts {};

TEST_F(ShownImports, TheAgeOfWhatOneImportsIsShownBesideTheRoundTrip) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  await_hosts("base", [](const wire::HostsDocument& hosts) {
    const auto* const from = hosts.find_host("head");
    const auto* const import = hosts.find_import(kPlanner);
    return from != nullptr && from->round_trip && import != nullptr && import->is_open;
  });
  const testing::Matcher<std::string> line = testing::ContainsRegex(
      "From other hosts:\n  /Planner/speed:o  from host head, round trip [0-9.]+ ms, "
      "[0-9.]+ .?s ago");
  for (const std::vector<std::string>& verb :
       {std::vector<std::string>{"why", kMotor}, {"status", "--all"}}) {
    // A link that is slow today is left out, and that is said.
    await([&] { return testing::Value(run_arbiter("base", verb).out, line); });
  }
}

TEST_F(ShownImports, FromWhereASourceCameIsShownOnceItIsGone) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Body body(base);
  {
    Planner planner(head);
    body.drive(planner);
  }
  const std::string came = "/Planner/speed:o  came from host head, which does not offer it now";
  for (const std::vector<std::string>& verb :
       {std::vector<std::string>{"why", kMotor}, {"status", "--all"}}) {
    await([&] { return run_arbiter("base", verb).out.find(came) != std::string::npos; });
  }
  // On a busy machine counts follow, such as ", 43 late".
  EXPECT_THAT(run_arbiter("base", {"hosts"}).out,
              testing::ContainsRegex("\n  /Planner/speed:o  not imported: it came from host head"
                                     "(, [0-9]+ [a-z ]+)*\n"));
}

// What `arbiter echo` prints until it has printed that.
std::string await_echo(Planner& planner, const std::string& what, const std::string& instance,
                       std::vector<std::string> arguments) {
  const shm::FileDescriptor seen(::memfd_create("echo", MFD_CLOEXEC));
  arguments.insert(arguments.begin(), {std::string(ARBITER_PROGRAMS) + "/arbiter", "echo"});
  arguments.insert(arguments.end(), {"--instance", instance});
  ChildProcess echo(arguments, {}, {-1, seen.get(), -1});
  const auto text = [&] { return content_of("/proc/self/fd/" + std::to_string(seen.get())); };
  await([&] {
    planner.publish();
    return text().find(what) != std::string::npos;
  });
  echo.signal(SIGINT);
  EXPECT_EQ(echo.wait(), 0);
  return text();
}

TEST_F(ShownImports, EchoSaysFromWhichOneArrivalsCome) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  await_echo(planner, " (host head #", "base", {kPlanner});
  await_echo(planner, " (host head #", "base", {kMotor, "--as-component"});
  const std::string lines = await_echo(planner, "\"host\":\"head\"", "base", {kPlanner, "--json"});
  EXPECT_THAT(lines, HasSubstr("\"origin\":{\"host\":\"head\",\"publisher\":"));
  const std::string local = await_echo(planner, "#", "head", {kPlanner});
  EXPECT_THAT(local, Not(HasSubstr("(host")));
  EXPECT_THAT(local, Not(HasSubstr("(there")));
}

TEST_F(ShownImports, ARecordingHasTheOneThatASourceComesFrom) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  const TemporaryDirectory files;
  const std::string file = files.file("recording.mcap");
  ChildProcess record(
      {std::string(ARBITER_PROGRAMS) + "/arbiter", "record", "-o", file, "--instance", "base"}, {},
      {});
  await([&] {
    const ProgramResult info = arbiter({"recording", "info", file});
    return info.out.find("sources of other hosts\n  /Planner/speed:o  from head\n") !=
           std::string::npos;
  });
  record.signal(SIGINT);
  EXPECT_EQ(record.wait(), 0);
  const json imports = json::parse(arbiter({"recording", "info", "--json", file}).out)["imports"];
  EXPECT_EQ(imports, json::parse(R"([{"source": "/Planner/speed:o", "hosts": ["head"]}])"));
}

// Its node has the name of the links' own. It is a component nevertheless.
TEST_F(ShownImports, AComponentThatIsCalledLikeALinkIsExported) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head, 0, "arbiter-link");
  Body body(base);
  body.drive(planner);
  Planner near(base, planner.published(), "arbiter-link");
  await_hosts("base", [](const wire::HostsDocument& hosts) {
    const auto* const import = hosts.find_import(kPlanner);
    return import != nullptr && import->is_open_here && !import->is_open;
  });
}

}  // namespace
}  // namespace arbiter::test
