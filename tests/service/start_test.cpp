// How arbiterd starts and stops, and what it tells whoever started it.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include <arbiter/arbiter.hpp>

#include "shm/limits.hpp"
#include "tests/service/impatient.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::test {
namespace {

ProgramResult arbiterd(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), arbiterd_path());
  return run_program(arguments);
}

// Starts a daemon that must not become ready; tells its exit code and what it said.
std::pair<int, std::string> start_in_vain(const std::vector<std::string>& arguments,
                                          const Environment& environment) {
  const TemporaryDirectory directory;
  NotifySocket notify(directory.path() + "/notify");
  const std::string log_path = directory.write("log", "");
  const shm::FileDescriptor log(::open(log_path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC));
  std::vector<std::string> argv{arbiterd_path()};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  Environment all = environment;
  all["NOTIFY_SOCKET"] = notify.path();
  ChildProcess daemon(argv, all, {-1, -1, log.get()});
  EXPECT_FALSE(notify.wait_for("READY=1", daemon));
  const int code = daemon.wait();
  std::ifstream file(log_path);
  return {code, std::string(std::istreambuf_iterator<char>(file), {})};
}

TEST(Start, TellsTheServiceManagerThatItIsReadyAndThatItStops) {
  Daemon daemon;  // whose constructor has waited for READY=1
  daemon.process().signal(SIGTERM);
  EXPECT_TRUE(daemon.notify().wait_for("STOPPING=1", daemon.process()));
  EXPECT_EQ(daemon.process().wait(), 0);
}

TEST(Start, IsRefusedForWarningsIfItIsStrict) {
  const TemporaryDirectory directory;
  const auto model = directory.write(
      "model.xml",
      "<behaviors><source port='/unread'/><arbiter at='/in'><select from='/out'/></arbiter>"
      "</behaviors>");
  const Environment environment{{"RUNTIME_DIRECTORY", directory.path()}};
  const auto [code, log] = start_in_vain({"--strict", "--model", model}, environment);
  EXPECT_EQ(code, 1);
  EXPECT_NE(log.find(model + ":1:12: no rule reads or selects /unread"), std::string::npos) << log;
  EXPECT_NE(log.find("--strict treats warnings as errors"), std::string::npos) << log;
}

TEST(Start, SaysHowSeveralFilesOfOneModelAreGiven) {
  const TemporaryDirectory directory;
  const auto cart = directory.write(
      "cart.xml", "<behaviors><arbiter at='/in'><select from='/out'/></arbiter></behaviors>");
  const auto lights = directory.write(
      "lights.xml", "<behaviors><arbiter at='/light'><select from='/on'/></arbiter></behaviors>");
  const auto both = cart + "," + lights;
  const auto named = arbiterd({"--check", "--model", "work=" + both});
  EXPECT_EQ(named.exit_code, 1);
  EXPECT_NE(named.err.find("cannot open " + both + ": No such file or directory; "),
            std::string::npos)
      << named.err;
  EXPECT_NE(named.err.find("; write: --model work=" + cart + " --model work=" + lights + "\n"),
            std::string::npos)
      << named.err;
  const auto unnamed = arbiterd({"--check", "--model", both});
  EXPECT_NE(unnamed.err.find("; write: --model " + cart + " --model " + lights + "\n"),
            std::string::npos)
      << unnamed.err;
  const auto half = arbiterd({"--check", "--model", "work=" + cart + ",none"});
  EXPECT_EQ(half.err.find("write:"), std::string::npos) << half.err;
}

// Each alone could be loaded.
TEST(Start, IsNotPromisedForModelsThatTogetherNameTooMuch) {
  const TemporaryDirectory directory;
  std::vector<std::string> check{"--check"};
  for (const std::string name : {"one", "other"}) {
    std::string text = "<behaviors>";
    for (std::uint32_t i = 0; i <= shm::kMaxInputPorts / 2; ++i) {
      text += "<arbiter at='/" + name + std::to_string(i) + "'><select from='/out" +
              std::to_string(i / shm::kMaxDestinations) + "'/></arbiter>";
    }
    check.insert(check.end(),
                 {"--model", name + "=" + directory.write(name + ".xml", text + "</behaviors>")});
  }
  const auto result = arbiterd(check);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(
      result.err.find("the models together name 4098 input ports, and an instance has at most "
                      "4096"),
      std::string::npos)
      << result.err;
}

// As a daemon would find them, but nobody is served.
TEST(Start, ChecksItsFilesAndEndsIfThatIsAllItIsToDo) {
  const TemporaryDirectory directory;
  const auto model = directory.write(
      "model.xml", "<behaviors><arbiter at='/in'><select from='/out'/></arbiter></behaviors>");
  const auto policy = directory.write("policy", "allow everyone output /ouu\n");
  const std::vector<std::string> files{"--check", "--model", model, "--policy", policy};
  const auto result = arbiterd(files);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_NE(
      result.err.find(policy + ":1:23: no model names an output port that fits \"/ouu\"; did you "
                               "mean \"/out\"? [no-such-port]"),
      std::string::npos)
      << result.err;
  EXPECT_NE(result.err.find("a daemon can start with these files: 1 model, the policy " + policy),
            std::string::npos)
      << result.err;
  std::vector<std::string> strict = files;
  strict.push_back("--strict");
  EXPECT_EQ(arbiterd(strict).exit_code, 0) << "components may open ports that no model names";
  directory.write("model.xml", "<behaviors><source port='/unread'/></behaviors>");
  EXPECT_EQ(arbiterd(strict).exit_code, 1);
  directory.write("policy", "alow everyone output /out\n");
  const auto refused = arbiterd(files);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find(policy + ":1:1: \"alow\" is neither allow nor deny"),
            std::string::npos)
      << refused.err;
  EXPECT_NE(refused.err.find("the files have errors, listed above\n"), std::string::npos)
      << refused.err;
}

// Who is told of warnings looks for one.
TEST(Start, SpeaksOfStrictnessOnlyWhereWarningsAreAllThatIsWrong) {
  const TemporaryDirectory directory;
  const std::string strictness = "; --strict treats warnings as errors";
  const auto model =
      directory.write("model.xml", "<behaviors><source port='/unread'/></behaviors>");
  const auto warned = arbiterd({"--check", "--strict", "--model", model});
  EXPECT_EQ(warned.exit_code, 1);
  EXPECT_NE(warned.err.find("the files have errors, listed above" + strictness), std::string::npos)
      << warned.err;
  const std::vector<std::string> without_policy{"--strict", "--policy",
                                                directory.path() + "/nowhere"};
  std::vector<std::string> check = without_policy;
  check.emplace_back("--check");
  const auto refused = arbiterd(check);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("the files have errors, listed above\n"), std::string::npos)
      << refused.err;
  const auto [code, log] = start_in_vain(without_policy, {{"RUNTIME_DIRECTORY", directory.path()}});
  EXPECT_EQ(code, 1);
  EXPECT_NE(log.find("the files have errors, listed above\n"), std::string::npos) << log;
}

TEST(Start, SaysWhichOptionItDoesNotKnowAndWhatWasMeant) {
  const auto result = arbiterd({"--modle", "x"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.err,
            "arbiterd has no option \"--modle\"; did you mean \"--model\"?\n"
            "Run `arbiterd --help` for more information.\n");
  EXPECT_NE(arbiterd({"m.xml"}).err.find("no place for \"m.xml\"; did you mean --model m.xml?\n"),
            std::string::npos);
  EXPECT_EQ(arbiterd({"start"}).err.find("did you mean"), std::string::npos);
}

// Everybody may write to it, and nobody makes it a model by that.
TEST(Start, IsRefusedForADeviceWithoutAWordAboutWhoMayWriteIt) {
  const TemporaryDirectory directory;
  const auto [code, log] =
      start_in_vain({"--model", "/dev/null"}, {{"RUNTIME_DIRECTORY", directory.path()}});
  EXPECT_EQ(code, 1);
  EXPECT_NE(log.find("not a regular file but a device"), std::string::npos) << log;
  EXPECT_EQ(log.find("open-to-all"), std::string::npos) << log;
}

TEST(Start, StopsOnAnInterruptToo) {
  Daemon daemon;
  daemon.process().signal(SIGINT);
  EXPECT_EQ(daemon.process().wait(), 0);
}

TEST(Start, LeavesNoSocketBehind) {
  Daemon daemon;
  EXPECT_TRUE(std::filesystem::exists(daemon.socket_path()));
  EXPECT_EQ(daemon.terminate(), 0);
  EXPECT_FALSE(std::filesystem::exists(daemon.socket_path()));
  daemon.restart();
}

TEST(Start, StopsCleanlyWhileComponentsHavePorts) {
  Daemon daemon("<behaviors><arbiter at='/in'><select from='/out'/></arbiter></behaviors>");
  Node node("test");
  Node late = impatient_node("late");
  auto out = node.output_port<int>("/out");
  auto in = node.input_port<int>("/in");
  EXPECT_EQ(daemon.terminate(), 0);
  EXPECT_THROW({ auto other = late.output_port<int>("/other"); }, Error);
  EXPECT_EQ(out.publish(1).delivered, 1u);
  EXPECT_TRUE(in.take());
}

TEST(Start, TakesOverTheSocketOfADaemonThatWasKilled) {
  Daemon daemon;
  daemon.kill();
  EXPECT_TRUE(std::filesystem::exists(daemon.socket_path()));
  daemon.restart();
  Node node("test");
}

TEST(Start, RefusesASecondDaemonOfTheSameInstance) {
  Daemon daemon;
  const auto [code, log] = start_in_vain({"--instance", daemon.instance()}, {});
  EXPECT_EQ(code, 1);
  EXPECT_NE(log.find("a daemon of instance \"test\" is running already"), std::string::npos) << log;
  Node node("test");  // the first is not disturbed
}

TEST(Start, TwoInstancesLiveSideBySide) {
  const TemporaryDirectory runtime;
  Daemon one(kNoRules, {.instance = "one", .runtime_directory = runtime.path()});
  Daemon two(kNoRules, {.instance = "two", .runtime_directory = runtime.path()});
  Node in_one("test", {.instance = "one"});
  Node in_two("test", {.instance = "two"});
  auto here = in_one.output_port<int>("/out");
  auto there = in_two.output_port<int>("/out");
  EXPECT_TRUE(one.source("/out")["open"]);
  EXPECT_TRUE(two.source("/out")["open"]);
}

TEST(Start, TakesItsInstanceFromTheEnvironment) {
  const TemporaryDirectory runtime;
  const ScopedVariable directory("XDG_RUNTIME_DIR", runtime.path());
  const ScopedVariable none("RUNTIME_DIRECTORY", std::nullopt);
  for (const auto& [variable, socket] :
       std::vector<std::pair<std::optional<std::string>, std::string>>{
           {"from-environment", "from-environment.sock"}, {std::nullopt, "default.sock"}}) {
    NotifySocket notify(runtime.path() + "/" + socket + ".notify");
    ChildProcess daemon({arbiterd_path(), "--log-level", "error"},
                        {{"NOTIFY_SOCKET", notify.path()}, {"ARBITER_INSTANCE", variable}}, {});
    ASSERT_TRUE(notify.wait_for("READY=1", daemon));
    EXPECT_TRUE(std::filesystem::exists(runtime.path() + "/arbiter/" + socket));
    daemon.signal(SIGTERM);
    EXPECT_EQ(daemon.wait(), 0);
  }
}

TEST(Start, ABadModelEndsItBeforeItIsReady) {
  const TemporaryDirectory directory;
  const Environment runtime{{"XDG_RUNTIME_DIR", directory.path()}};
  const std::vector<std::pair<std::string, std::string>> models{
      {"empty.xml", ""},
      {"malformed.xml", "<behaviors>"},
      {"conflict.xml",
       "<behaviors><arbiter at='/in'><select from='/a'/><select "
       "from='/b'/></arbiter></behaviors>"}};
  for (const auto& [name, text] : models) {
    const std::string path = directory.write(name, text);
    const auto [code, log] = start_in_vain({"--model", path}, runtime);
    EXPECT_EQ(code, 1) << name;
    EXPECT_NE(log.find(path + ":1:"), std::string::npos) << log;
    EXPECT_NE(log.find("not started"), std::string::npos) << log;
    EXPECT_EQ(log.find("has errors: " + path), std::string::npos) << "told twice: " << log;
  }
  const auto [code, log] = start_in_vain({"--model", directory.path() + "/none.xml"}, runtime);
  EXPECT_EQ(code, 1);
  EXPECT_NE(log.find("none.xml"), std::string::npos) << log;
  EXPECT_FALSE(std::filesystem::exists(directory.path() + "/arbiter/default.sock"));
}

TEST(Start, SeveralFilesFormOneModel) {
  const TemporaryDirectory directory;
  const auto first = directory.write(
      "a.xml", "<behaviors><behavior name='A'><config at='/in'>/a</config></behavior></behaviors>");
  const auto second = directory.write(
      "b.xml",
      "<behaviors><behavior name='B'><config at='/in'>/b</config><inhibition>A</inhibition>"
      "</behavior></behaviors>");
  Daemon daemon("", {.arguments = {"--model", first, second}, .without_model = true});
  EXPECT_EQ(daemon.input("/in")["connections"].size(), 2u);
}

TEST(Start, WrongUsageIsExitCodeTwo) {
  EXPECT_EQ(arbiterd({"--nonsense"}).exit_code, 2);
  EXPECT_EQ(arbiterd({"--log-level", "loud"}).exit_code, 2);
  const auto instance = arbiterd({"--instance", "../x"});
  EXPECT_EQ(instance.exit_code, 2);
  EXPECT_NE(instance.err.find("\"../x\" is not a name for an instance"), std::string::npos);
}

TEST(Start, ItsHelpAndItsVersionGoToStandardOutput) {
  const auto help = arbiterd({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  for (const char* option : {"--model", "--application", "--instance"}) {
    EXPECT_NE(help.out.find(option), std::string::npos) << option;
  }
  const auto version = arbiterd({"--version"});
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_EQ(version.out.rfind("arbiterd ", 0), 0u);
}

TEST(Start, RunsUnprivileged) {
  const std::string setpriv = "/usr/bin/setpriv";
  if (::geteuid() != 0 || !std::filesystem::exists(setpriv)) {
    GTEST_SKIP() << "this test runs as a user without privileges anyhow";
  }
  const TemporaryDirectory directory;
  ASSERT_EQ(::chown(directory.path().c_str(), 65534, 65534), 0);
  NotifySocket notify(directory.path() + "/notify");
  ASSERT_EQ(::chmod(notify.path().c_str(), 0777), 0);
  const std::string copy = directory.path() + "/arbiterd";  // where that user may read it
  std::filesystem::copy_file(arbiterd_path(), copy);
  ChildProcess daemon(
      {setpriv, "--reuid=65534", "--regid=65534", "--clear-groups", copy, "--log-level", "error"},
      {{"NOTIFY_SOCKET", notify.path()},
       {"XDG_RUNTIME_DIR", directory.path()},
       {"RUNTIME_DIRECTORY", std::nullopt},
       {"ARBITER_INSTANCE", std::nullopt}},
      {});
  ASSERT_TRUE(notify.wait_for("READY=1", daemon));
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST(Start, AHangUpReadsTheFilesAgain) {
  Daemon daemon(kNoRules);
  EXPECT_EQ(daemon.generation(), 1u);
  daemon.load("<behaviors><arbiter at='/in'><select from='/a'/></arbiter></behaviors>");
  EXPECT_EQ(daemon.generation(), 2u);
  EXPECT_EQ(daemon.input("/in")["connections"].size(), 1u);
  daemon.load_bad("<behaviors><arbiter at='/in'/>");
  EXPECT_EQ(daemon.generation(), 2u);
  EXPECT_EQ(daemon.refused(), 1u);
  EXPECT_EQ(daemon.input("/in")["connections"].size(), 1u);
  EXPECT_NE(daemon.log().find("the model in force stays"), std::string::npos);
}

TEST(Start, AHangUpReadsTheApplicationAgainToo) {
  const auto connect = [](const std::string& from) {
    return "<application><connection><from>" + from +
           "</from><to>/in</to></connection></application>";
  };
  Daemon daemon(kNoRules, {.application = connect("/a")});
  daemon.write_application(connect("/b"));
  daemon.load(kNoRules);
  EXPECT_EQ(daemon.input("/in")["connections"][0]["source"], "/b");
}

TEST(Start, AHangUpWithoutAModelIsHarmless) {
  Daemon daemon("", {.without_model = true});
  daemon.hang_up();
  EXPECT_EQ(daemon.generation(), 0u);
}

}  // namespace
}  // namespace arbiter::test
