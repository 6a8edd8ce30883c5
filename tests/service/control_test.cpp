// arbiter reload, arbiter stop, and daemons that get files that they cannot use.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include <arbiter/arbiter.hpp>
#include <nlohmann/json.hpp>

#include "tests/support/daemon.hpp"
#include "tests/support/other_user.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::Not;
using wire::MessageKind;

ProgramResult arbiter(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), std::string(ARBITER_PROGRAMS) + "/arbiter");
  return run_program(arguments);
}

std::string model_from(const std::string& source) {
  return "<behaviors><arbiter at='/in'><select from='" + source + "'/></arbiter></behaviors>";
}

TEST(Control, ReloadAnswersWhenTheModelIsInForce) {
  Daemon daemon(model_from("/a"));
  Node node("component");  // whose service thread has to be told first
  auto in = node.input_port<int>("/in");
  daemon.write_model(model_from("/b"));
  const auto result = arbiter({"reload"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "model 2 is in force\n  1 of 1 port decides differently (/in)\n");
  EXPECT_EQ(daemon.input("/in")["connections"][0]["source"], "/b");
}

TEST(Control, ReloadTellsWhyAModelIsRefused) {
  Daemon daemon(model_from("/a"));
  daemon.write_model("<behaviors>\n<nonsense/><source/></behaviors>");
  const auto result = arbiter({"reload"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr("model.xml:2:1: error: <nonsense> is not known here"));
  EXPECT_THAT(result.err, HasSubstr("model.xml:2:12: error: "));
  EXPECT_THAT(result.err, HasSubstr("2 errors"));
  EXPECT_EQ(daemon.generation(), 1u);
  EXPECT_EQ(daemon.refused(), 1u);
}

TEST(Control, ReloadNeedsAFile) {
  Daemon daemon("", {.without_model = true});
  const auto result = arbiter({"reload"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("there is no file to read again"));
}

TEST(Control, ReloadReadsAPolicyWhereThereIsNoModel) {
  const TemporaryDirectory files;
  const auto policy = files.write("policy", "deny everyone input *\n");
  Daemon daemon("", {.arguments = {"--policy", policy}, .without_model = true});
  Node node("component");
  EXPECT_THROW({ auto in = node.input_port<int>("/in"); }, Error);
  files.write("policy", "allow everyone input *\n");
  const auto result = arbiter({"reload"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "no model is in force\nthe policy " + policy + " is in force, 1 rule\n");
  auto in = node.input_port<int>("/in");
}

TEST(Control, ReloadTellsOfThePolicyIfItsRulesHaveChanged) {
  const TemporaryDirectory files;
  const auto policy = files.write("policy", "allow everyone all\n");
  Daemon daemon(model_from("/a"), {.arguments = {"--policy", policy}});
  const std::string same = "  no difference: 1 port decides alike in every state\n";
  files.write("policy", "# as it was\nallow everyone all\n");
  EXPECT_EQ(arbiter({"reload"}).out, "model 2 is in force\n" + same);
  files.write("policy", "deny everyone stop\nallow everyone all\n");
  EXPECT_THAT(arbiter({"reload", "--dry-run"}).out,
              HasSubstr("the policy " + policy +
                        " differs from the one in force: it has 2 rules\nthis was a dry run"));
  const auto report = nlohmann::json::parse(arbiter({"reload", "--dry-run", "--json"}).out);
  EXPECT_EQ(report["policy"], (nlohmann::json{{"file", policy}, {"rules", 2}, {"differs", true}}));
  EXPECT_EQ(arbiter({"reload"}).out,
            "model 3 is in force\n" + same + "the policy " + policy + " is in force, 2 rules\n");
  EXPECT_THAT(arbiter({"reload", "--dry-run"}).out, Not(HasSubstr("policy")));
  EXPECT_EQ(nlohmann::json::parse(arbiter({"reload", "--json"}).out)["policy"]["differs"], false);
  EXPECT_EQ(nlohmann::json::parse(arbiter({"rollback", "1", "--json"}).out)["policy"], nullptr);
}

TEST(Control, DeactivateSaysWhoAloneEndsTheActivityOfAnOpenSource) {
  Daemon daemon(model_from("/a"));
  Node node("component");
  auto out = node.output_port<int>("/a");
  const auto result = arbiter({"deactivate", "/a"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "arbiter: the output port /a is held by node \"component\" (pid " +
                            std::to_string(::getpid()) +
                            "), which alone can end its activity: stop it, or let it call "
                            "deactivate()\n");
}

// Nobody writes to it: a daemon that opened it would not even end when it is told to.
TEST(Control, AFifoInPlaceOfAFileIsRefusedAndHoldsNobodyUp) {
  const TemporaryDirectory files;
  const auto application = files.write(
      "application.xml",
      "<application><connection><from>/a</from><to>/in</to></connection></application>");
  const auto policy = files.write("policy", "allow everyone all\n");
  Daemon daemon(model_from("/a"),
                {.arguments = {"--application", application, "--policy", policy}});
  for (const std::string& path : {daemon.directory() + "/model.xml", application, policy}) {
    std::filesystem::rename(path, path + ".good");
    ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
    const auto result = arbiter({"reload"});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, HasSubstr("cannot read " + path + ": it is not a regular file"));
    std::filesystem::rename(path + ".good", path);
  }
  EXPECT_EQ(daemon.generation(), 1u);
  EXPECT_EQ(arbiter({"reload"}).exit_code, 0);
}

// Each is told of a reading that began after it asked.
TEST(Control, EveryReloadIsAnswered) {
  Daemon daemon(model_from("/a"));
  Node node("component");
  auto in = node.input_port<int>("/in");
  std::vector<RawClient> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back(daemon.instance());
    clients.back().hello("asks");
  }
  daemon.process().stop();
  for (RawClient& client : clients) client.send(RawClient::message(MessageKind::kReload));
  daemon.process().signal(SIGCONT);
  for (RawClient& client : clients) {
    EXPECT_GE(client.expect(MessageKind::kDone).message.value, 2u);
  }
  EXPECT_GE(daemon.generation(), 2u);
}

TEST(Control, StopReturnsWhenTheDaemonIsGone) {
  Daemon daemon(model_from("/a"));
  Node node("component");
  auto out = node.output_port<int>("/a");
  auto in = node.input_port<int>("/in");
  const auto result = arbiter({"stop"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  pollfd ended{daemon.process().descriptor(), POLLIN, 0};
  EXPECT_EQ(::poll(&ended, 1, 0), 1);
  EXPECT_EQ(daemon.process().wait(), 0);
  EXPECT_EQ(out.publish(1).delivered, 1u);
  EXPECT_TRUE(in.take());
}

TEST(Control, TheVerbsTellThatThereIsNoDaemon) {
  const TemporaryDirectory empty;
  const ScopedVariable runtime("XDG_RUNTIME_DIR", empty.path());
  for (const std::string verb : {"reload", "stop", "switch", "rollback", "history"}) {
    const auto result = arbiter({verb, "--instance", "no-such-daemon"});
    EXPECT_EQ(result.exit_code, 1) << verb;
    EXPECT_THAT(result.err, HasSubstr("no arbiterd of instance \"no-such-daemon\"")) << verb;
    const auto help = arbiter({verb, "--help"});
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_THAT(help.out, HasSubstr("Example:\n  arbiter " + verb));
  }
}

TEST(Control, AVerbThatFindsNoDaemonNamesTheInstancesThatRun) {
  const TemporaryDirectory runtime;
  const Daemon one(kNoRules, {.instance = "near-by", .runtime_directory = runtime.path()});
  const Daemon two(kNoRules, {.instance = "robot-2", .runtime_directory = runtime.path()});
  for (const std::string verb : {"status", "reload"}) {
    const auto result = arbiter({verb, "--instance", "nearby"});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, HasSubstr("these instances run: near-by, robot-2")) << verb;
  }
}

TEST(Control, ADaemonThatDoesNotAnswerIsNoneThatDoesNotRun) {
  Daemon daemon;
  daemon.process().stop();
  for (const std::string verb : {"status", "reload"}) {
    const auto result = arbiter({verb});
    EXPECT_EQ(result.exit_code, 1) << verb;
    EXPECT_THAT(result.err, HasSubstr("arbiterd (pid " + std::to_string(daemon.process().pid()) +
                                      ") of instance \"test\" runs, but did not answer within "))
        << verb;
    EXPECT_THAT(result.err, Not(HasSubstr("start one"))) << verb;
  }
  daemon.process().signal(SIGCONT);
  EXPECT_EQ(daemon.generation(), 1u);  // what was not asked does not come later
}

// Here the test is the daemon, which takes its time.
TEST(Control, AVerbTellsWhomItWaitsFor) {
  const TemporaryDirectory runtime;
  const ScopedVariable directory("XDG_RUNTIME_DIR", runtime.path());
  const ScopedVariable own("RUNTIME_DIRECTORY", std::nullopt);
  std::filesystem::create_directory(runtime.path() + "/arbiter");
  const auto listener = wire::listen_at(runtime.path() + "/arbiter", "slow");
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  const shm::FileDescriptor err(ends[0]);
  shm::FileDescriptor their_err(ends[1]);
  ChildProcess verb({ARBITER_PROGRAMS "/arbiter", "reload", "--instance", "slow"}, {},
                    {-1, -1, their_err.get()});
  their_err.reset();
  const shm::FileDescriptor client(::accept(listener.socket.get(), nullptr, nullptr));
  const auto answer = [&](MessageKind kind, const std::string& text) {
    wire::Received question;
    ASSERT_EQ(wire::receive_message(client.get(), question, true), wire::ReceiveResult::kReceived);
    std::string said;
    while (said.find(text) == std::string::npos) {
      char part[512];
      const ssize_t count = ::read(err.get(), part, sizeof part);
      ASSERT_GT(count, 0) << said;
      said.append(part, static_cast<std::size_t>(count));
    }
    wire::Message reply = RawClient::message(kind);
    reply.request = question.message.request;
    ASSERT_EQ(wire::send_message(client.get(), reply), wire::SendResult::kSent);
  };
  answer(MessageKind::kWelcome, "");
  answer(MessageKind::kRefused, "waiting for arbiterd (pid " + std::to_string(::getpid()) +
                                    ") of instance \"slow\" to answer");
  EXPECT_EQ(verb.wait(), 1);
}

TEST(Control, TheVerbsTellThatThePolicyRefuses) {
  const TemporaryDirectory files;
  const auto policy = files.write("policy", "deny everyone reload,stop,switch,observe\n");
  Daemon daemon(kNoRules, {.arguments = {"--policy", policy}});
  const std::vector<std::vector<std::string>> refused{
      {"reload"}, {"reload", "--dry-run"}, {"rollback"}, {"stop"}, {"switch", "a"}, {"switch"},
      {"history"}};
  for (const auto& verb : refused) {
    const auto result = arbiter(verb);
    EXPECT_EQ(result.exit_code, 1) << verb[0];
    EXPECT_THAT(result.err, HasSubstr(policy + ":1 says: deny everyone reload,stop,switch,observe"))
        << verb[0];
  }
}

TEST(Control, ADaemonDoesNotStartWithAPolicyThatItCannotUse) {
  const TemporaryDirectory files;
  const ScopedVariable runtime("XDG_RUNTIME_DIR", files.path());
  const ScopedVariable own("RUNTIME_DIRECTORY", std::nullopt);
  const auto writable = files.write("writable", "allow everyone all\n");
  ASSERT_EQ(::chmod(writable.c_str(), 0666), 0);
  const std::vector<std::pair<std::string, std::string>> unusable{
      {files.write("bad", "# x\nallow bob stop\n"),
       "bad:2:7: \"bob\" stands where it must say who"},
      {files.write("empty", ""), "empty:1:1: the policy has no line"},
      {files.path() + "/none", "cannot open " + files.path() + "/none: No such file"},
      {files.path(), "cannot read " + files.path() + ": Is a directory"},
      {"/dev/zero", "cannot read /dev/zero: it is not a regular file but a device"},
      {writable, "every user may write the policy " + writable + "; run: chmod o-w "}};
  for (const auto& [path, message] : unusable) {
    const auto result =
        run_program({arbiterd_path(), "--instance", "unusable-policy", "--policy", path});
    EXPECT_EQ(result.exit_code, 1) << path;
    EXPECT_THAT(result.err, HasSubstr(message)) << path;
  }
}

}  // namespace
}  // namespace arbiter::test
