// arbiter reload, switch, rollback and history.
#include "tests/service/changing_models.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <arbiter/arbiter.hpp>

#include "service/models/history.hpp"
#include "tests/cli/arbiter_program.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"

namespace arbiter::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using wire::MessageKind;

TEST_F(ChangingModels, SwitchGoesToAnotherModelAndListsAll) {
  start();
  const std::string default_files = "default " + daemon_->directory() + "/model.xml\n";
  const std::string other_files = "other " + files_.path() + "/other.xml\n";
  expect_success(arbiter({"switch"}), "* " + default_files + "  " + other_files);
  expect_success(arbiter({"switch", "other"}), "model 2 is in force\n");
  EXPECT_EQ(source_in_force(), "/b");
  expect_success(arbiter({"switch", "other"}), "model 2 is in force already\n");
  EXPECT_EQ(nlohmann::json::parse(arbiter({"switch", "other", "--json"}).out)["already"], true);
  expect_success(arbiter({"switch"}), "  " + default_files + "* " + other_files);
  EXPECT_THAT(arbiter({"status"}).out, HasSubstr(", model 2 other " + files_.path()));
  expect_refusal(arbiter({"switch", "third"}),
                 "there is no model \"third\"; there are: default and other");
  expect_refusal(arbiter({"switch", "third.xml"}),
                 "there is no model \"third.xml\"; there are: default and other; arbiterd --model "
                 "NAME=FILE gives a file a name");
  EXPECT_EQ(name_in_force(), "other");
}

TEST_F(ChangingModels, SwitchReadsNoFile) {
  start();
  write_other("<nonsense/>");
  const int watch = ::inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  ASSERT_GE(::inotify_add_watch(watch, (files_.path() + "/other.xml").c_str(), IN_OPEN), 0);
  expect_success(arbiter({"switch", "other"}), "model 2 is in force\n");
  char event[512];
  EXPECT_EQ(::read(watch, event, sizeof event), -1) << "it was opened";
  ::close(watch);
  EXPECT_EQ(source_in_force(), "/b");
}

// What a link asks before all hosts switch.
TEST_F(ChangingModels, ADryRunSaysWhetherASwitchWouldBeRefusedAndMakesNone) {
  start();
  RawClient client(daemon_->instance());
  client.hello("asks");
  const auto ask = [&](const std::string& name, std::uint32_t flags) {
    auto message = RawClient::message(MessageKind::kSwitch, name);
    message.flags = wire::kDryRun | flags;
    client.send(message);
  };
  ask("other", 0);
  EXPECT_EQ(client.expect(MessageKind::kDone).message.value, 1u) << "the one in force";
  ask("default", 0);
  client.expect(MessageKind::kDone);
  ask("third", 0);
  EXPECT_EQ(client.expect_refusal(), "there is no model \"third\"; there are: default and other");
  ask("third", wire::kWantsReport);
  client.expect(MessageKind::kReport);
  EXPECT_EQ(daemon_->generation(), 1u);
  EXPECT_EQ(name_in_force(), "default");
  EXPECT_THAT(daemon_->log(), Not(HasSubstr("the model in force stays")));
}

// The table of a model that has been in force before is there; the report needs a descriptor. It
// must never say that nothing was done where it was.
TEST_F(ChangingModels, ASwitchThatIsDoneIsNoRefusalThoughNoDescriptorIsLeft) {
  start();
  arbiter({"switch", "other"});
  RawClient client(daemon_->instance());
  client.hello("switches");
  // Not to be raised again by the daemon: where it receives, it raises the soft one.
  const rlimit none{1, 1};
  ASSERT_EQ(::prlimit(daemon_->process().pid(), RLIMIT_NOFILE, &none, nullptr), 0);
  int done = 0;
  for (const std::string model : {"default", "other", "default", "other"}) {
    auto question = RawClient::message(MessageKind::kSwitch, model);
    question.flags = wire::kWantsReport;
    client.send(question);
    wire::Received answer;
    ASSERT_TRUE(client.receive(answer));
    const std::string log = daemon_->log();
    const bool is_done =
        log.find("model " + std::to_string(done + 3) + " is in force") != std::string::npos;
    EXPECT_EQ(answer.message.kind, is_done ? MessageKind::kDone : MessageKind::kRefused) << log;
    if (!is_done) continue;
    ++done;
    EXPECT_EQ(answer.message.value, static_cast<std::uint64_t>(done) + 2);
  }
  EXPECT_GT(done, 0) << "nothing was done without a report";
}

TEST_F(ChangingModels, SwitchWithoutAModelSaysSo) {
  daemon_.emplace("", Daemon::Options{.without_model = true});
  expect_success(arbiter({"switch"}), "no model is loaded; start the daemon with --model\n");
  expect_refusal(arbiter({"switch", "a"}), "there is no model \"a\"; none is loaded");
  expect_success(arbiter({"history"}), "no model has been in force\n");
  expect_refusal(arbiter({"rollback"}), "there is no model to go back to: none has been in force");
}

// A source that is declared, and that no rule reads.
std::string with_warning(const std::string& source) {
  return rules("<source port='/unread'/>" + arbiter_at("/in", select("/" + source)));
}

TEST_F(ChangingModels, AReloadTellsWarningsAndGoesOn) {
  start();
  daemon_->write_model(with_warning("c"));
  const auto result = arbiter({"reload"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("warning: no rule reads or selects /unread"));
  EXPECT_THAT(daemon_->log(), HasSubstr("no rule reads or selects /unread"));
  EXPECT_EQ(source_in_force(), "/c");
}

TEST_F(ChangingModels, AStrictDaemonRefusesWarningsAndKeepsWhatItHas) {
  start({"--strict"});
  daemon_->write_model(with_warning("c"));
  const auto result = arbiter({"reload"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("error: no rule reads or selects /unread"));
  EXPECT_EQ(source_in_force(), "/a");
  EXPECT_EQ(arbiter({"reload", "--dry-run"}).exit_code, 1);
  daemon_->write_model(only("c"));
  EXPECT_EQ(arbiter({"reload"}).exit_code, 0);
  EXPECT_EQ(source_in_force(), "/c");
}

// As of a policy, but that a model has no more than a warning.
TEST_F(ChangingModels, AFileThatEveryUserMayWriteIsToldAndRefusedByAStrictDaemon) {
  for (const bool is_strict : {false, true}) {
    start(is_strict ? std::vector<std::string>{"--strict"} : std::vector<std::string>{});
    daemon_->write_model(only("c"));
    const std::string path = daemon_->directory() + "/model.xml";
    ASSERT_EQ(::chmod(path.c_str(), 0666), 0);
    const auto result = arbiter({"reload"});
    EXPECT_EQ(result.exit_code, is_strict ? 1 : 0);
    EXPECT_THAT(result.err, HasSubstr("every user may write this file"));
    ASSERT_EQ(::chmod(path.c_str(), 0644), 0);
    EXPECT_EQ(arbiter({"reload"}).exit_code, 0);
  }
}

TEST_F(ChangingModels, ReloadReadsAllAndStaysWithTheOneInForce) {
  start();
  ASSERT_EQ(arbiter({"switch", "other"}).exit_code, 0);
  daemon_->write_model(only("c"));
  write_other(only("d"));
  const auto result = arbiter({"reload"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "model 3 is in force\n  1 of 1 port decides differently (/in)\n");
  EXPECT_EQ(source_in_force(), "/d");
  ASSERT_EQ(arbiter({"switch", "default"}).exit_code, 0);
  EXPECT_EQ(source_in_force(), "/c");
}

TEST_F(ChangingModels, OneBadModelRefusesTheWholeReload) {
  start();
  daemon_->write_model(only("c"));
  write_other("<behaviors>\n<nonsense/><source/></behaviors>");
  const auto result = arbiter({"reload"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, AllOf(HasSubstr("the model other:\n"),
                                HasSubstr("other.xml:2:1: error: <nonsense> is not known here"),
                                HasSubstr("other.xml:2:12: error: "), HasSubstr("2 errors"),
                                HasSubstr("arbiter: refused; nothing has changed\n")));
  EXPECT_EQ(source_in_force(), "/a");
  ASSERT_EQ(arbiter({"switch", "other"}).exit_code, 0);
  EXPECT_EQ(source_in_force(), "/b") << "as it was read before";
}

TEST_F(ChangingModels, ADryRunShowsWhatAReloadWouldDo) {
  start();
  ASSERT_EQ(arbiter({"switch", "other"}).exit_code, 0);
  write_other(only("b") + " ");
  auto result = arbiter({"reload", "--dry-run"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("default: no difference: 1 port decides alike"),
                    HasSubstr("other (in force): no difference"), HasSubstr("this was a dry run")));
  write_other(only("d"));
  result = arbiter({"reload", "--dry-run"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("other (in force):\n/in\n"), HasSubstr("/d"),
                                HasSubstr("1 of 1 port decides differently (/in)")));
  const auto report = nlohmann::json::parse(arbiter({"reload", "--dry-run", "--json"}).out);
  EXPECT_EQ(report["ok"], true);
  EXPECT_EQ(report["models"][1]["changes"]["diff"]["differs"], true);
  write_other("<nonsense/>");
  result = arbiter({"reload", "--dry-run"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("nonsense"));
  EXPECT_EQ(daemon_->generation(), 2u);
  EXPECT_EQ(daemon_->refused(), 0u);
  ASSERT_EQ(arbiter({"switch", "default"}).exit_code, 0);
  ASSERT_EQ(arbiter({"switch", "other"}).exit_code, 0);
  EXPECT_EQ(source_in_force(), "/b");
}

TEST_F(ChangingModels, WhatChangesHasOneTypeInEachReport) {
  start();
  daemon_->write_model(only("c"));
  const auto dry = nlohmann::json::parse(arbiter({"reload", "--dry-run", "--json"}).out);
  const auto reload = nlohmann::json::parse(arbiter({"reload", "--json"}).out);
  EXPECT_EQ(reload["changes"], dry["models"][0]["changes"]);
  EXPECT_EQ(reload["changes"]["summary"], "1 of 1 port decides differently (/in)");
  EXPECT_EQ(reload["changes"]["diff"]["ports"][0]["port"], "/in");
  EXPECT_EQ(reload["back_to"], nullptr);
  const auto rollback = nlohmann::json::parse(arbiter({"rollback", "--json"}).out);
  EXPECT_EQ(rollback["back_to"]["generation"], 1);
  EXPECT_EQ(rollback["back_to"]["name"], "default");
  EXPECT_EQ(rollback["back_to"]["files"][0], daemon_->directory() + "/model.xml");
  EXPECT_TRUE(rollback["changes"].is_object());
  const auto to_other = nlohmann::json::parse(arbiter({"switch", "other", "--json"}).out);
  EXPECT_EQ(to_other["changes"], nullptr) << "not compared";
}

// What cannot be judged for an error in it is not; the rest is, as by arbiter check.
TEST_F(ChangingModels, ARefusedReloadTellsOfAllProblemsInFields) {
  start();
  daemon_->write_model(
      "<behaviors><source port='/a' timeout='5 parsecs'/><arbiter at='/in'><select from='/a'/>"
      "<select from='/b'/></arbiter></behaviors>");
  const auto result = arbiter({"reload", "--json"});
  EXPECT_EQ(result.exit_code, 1);
  const auto report = nlohmann::json::parse(result.out);
  const auto& found = report["findings"][0]["findings"];
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0]["code"], "invalid-timeout");
  EXPECT_EQ(found[1]["code"], "both-can-win");
  EXPECT_EQ(found[1]["port"], "/in");
  EXPECT_EQ(found[1]["source"], "/b");
  EXPECT_EQ(found[1]["winners"][0]["winner"], "/a");
}

TEST_F(ChangingModels, RollbackGoesBackStepByStepOrToOneByItsNumber) {
  Daemon& daemon = start();
  daemon.load(only("b"));
  daemon.load(only("c"));
  auto result = arbiter({"rollback"});
  EXPECT_EQ(result.out, "model 4 is in force\n  it is model 2 again: default " +
                            daemon.directory() +
                            "/model.xml (reload)\n"
                            "  1 of 1 port decides differently (/in)\n");
  EXPECT_EQ(source_in_force(), "/b");
  EXPECT_THAT(arbiter({"switch"}).out, HasSubstr("(after a rollback, an older one is in force)"));
  ASSERT_EQ(arbiter({"rollback"}).exit_code, 0);
  EXPECT_EQ(source_in_force(), "/a");
  expect_refusal(arbiter({"rollback"}),
                 "model 5 decides as model 1 does, the oldest that is kept; to go to another, say "
                 "which: arbiter history shows all");
  ASSERT_EQ(arbiter({"rollback", "3"}).exit_code, 0);
  EXPECT_EQ(source_in_force(), "/c");
  expect_refusal(arbiter({"rollback", "9"}),
                 "model 9 is not in the history; arbiter history shows what is");
  const auto wrong = arbiter({"rollback", "0"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("\"0\" is not a whole number of at least 1"));
  EXPECT_EQ(daemon.generation(), 6u);
  ASSERT_EQ(arbiter({"reload"}).exit_code, 0);
  EXPECT_EQ(source_in_force(), "/c") << "what the file says";
}

TEST_F(ChangingModels, ARollbackNamesNoModelThatHasLeftTheHistory) {
  start();
  for (std::size_t i = 0; i < service::History::kMaxEntries; ++i) {
    ASSERT_EQ(arbiter({"reload"}).exit_code, 0);
  }
  expect_refusal(
      arbiter({"rollback"}),
      "there is no older model to go back to: model 17 decides as model 1 did, which has "
      "left the history; arbiter history shows what is in it");
}

// What is in force after a rollback is not the object that the library has.
TEST_F(ChangingModels, AModelThatStaysAsItIsIsNoStepAfterARollbackEither) {
  start();
  ASSERT_EQ(arbiter({"switch", "other"}).exit_code, 0);
  ASSERT_EQ(arbiter({"reload"}).exit_code, 0);
  expect_success(arbiter({"rollback"}), "model 4 is in force\n  it is model 1 again: default " +
                                            daemon_->directory() +
                                            "/model.xml (start)\n"
                                            "  1 of 1 port decides differently (/in)\n");
  ASSERT_EQ(source_in_force(), "/a");
  ASSERT_EQ(arbiter({"reload"}).exit_code, 0);
  ASSERT_EQ(arbiter({"reload"}).exit_code, 0);
  expect_refusal(arbiter({"rollback"}),
                 "model 6 decides as model 1 does, the oldest that is kept; to go to another, say "
                 "which: arbiter history shows all");
  ASSERT_EQ(arbiter({"rollback", "1"}).exit_code, 0);
  ASSERT_EQ(arbiter({"switch", "default"}).exit_code, 0);
  expect_refusal(arbiter({"rollback"}),
                 "model 8 decides as model 1 does, the oldest that is kept; to go to another, say "
                 "which: arbiter history shows all");
}

TEST_F(ChangingModels, HistoryTellsWhatWhenHowAndByWhom) {
  start();
  daemon_->load(only("c"));
  ASSERT_EQ(arbiter({"switch", "other"}).exit_code, 0);
  ASSERT_EQ(arbiter({"rollback", "1"}).exit_code, 0);
  const auto history = nlohmann::json::parse(arbiter({"history", "--json"}).out);
  ASSERT_EQ(history.size(), 4u);
  const std::vector<std::string> how{"rollback to 1", "switch", "reload", "start"};
  const std::vector<std::string> by{"node \"arbiter-rollback\" (pid ", "node \"arbiter-switch\"",
                                    "a signal of process " + std::to_string(::getpid()), ""};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(history[i]["generation"], 4 - i);
    EXPECT_EQ(history[i]["how"], how[i]);
    EXPECT_EQ(history[i]["name"], i == 1 ? "other" : "default");
    EXPECT_GT(history[i]["since_ms"], 1'600'000'000'000);
    if (i == 3) {
      EXPECT_EQ(history[i]["by"], nullptr);
    } else {
      EXPECT_THAT(history[i]["by"].get<std::string>(), HasSubstr(by[i]));
    }
  }
  EXPECT_EQ(history[2]["changes"], "1 of 1 port decides differently (/in)");
  EXPECT_EQ(history[1]["changes"], nullptr);
  EXPECT_EQ(history[0]["content"], 1);
  EXPECT_THAT(arbiter({"history"}).out, HasSubstr("  other  switch, by node \"arbiter-switch\""));
  EXPECT_THAT(daemon_->log(), HasSubstr("model 2 is in force: reload \"default\", by a signal"));
  EXPECT_THAT(daemon_->log(), HasSubstr("model 2 compared with the last: 1 of 1 port decides"));
}

// A policy that was refused together with a model must not slip in with the next swap.
TEST_F(ChangingModels, ARefusedPolicyStaysRefused) {
  const auto policy = files_.write("policy", "allow everyone all\n");
  start({"--policy", policy});
  files_.write("policy", "deny everyone reload\n");
  write_other("<nonsense/>");
  EXPECT_EQ(arbiter({"reload"}).exit_code, 1);
  EXPECT_EQ(arbiter({"switch", "other"}).exit_code, 0);
  write_other(only("b"));
  files_.write("policy", "deny everyone switch\nallow everyone all\n");
  EXPECT_EQ(arbiter({"reload"}).exit_code, 0);
  EXPECT_EQ(arbiter({"switch", "default"}).exit_code, 1);
}

// Changes are made in the order in which they are asked for, though one cannot be made yet.
TEST_F(ChangingModels, WaitForEachOther) {
  start();
  RawClient client(daemon_->instance());
  client.hello("asks");
  const auto ask = [&](MessageKind kind, std::uint64_t request, const std::string& name = {}) {
    auto message = RawClient::message(kind, name);
    message.request = request;
    client.send(message);
  };
  daemon_->process().stop();
  ask(MessageKind::kSwitch, 1, "other");
  ask(MessageKind::kReload, 2);
  ask(MessageKind::kReload, 3);
  ask(MessageKind::kSwitch, 4, "default");
  ask(MessageKind::kRollback, 5);
  ask(MessageKind::kSwitch, 6, "none");
  daemon_->process().signal(SIGCONT);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> answers;
  for (int i = 0; i < 6; ++i) {
    wire::Received received;
    ASSERT_TRUE(client.receive(received));
    answers.emplace_back(received.message.request, received.message.value);
    if (i == 5) {
      EXPECT_EQ(received.message.kind, MessageKind::kRefused);
    }
  }
  const std::vector<std::pair<std::uint64_t, std::uint32_t>> expected{{1, 2}, {2, 3}, {3, 3},
                                                                      {4, 4}, {5, 5}, {6, 0}};
  EXPECT_EQ(answers, expected);
  EXPECT_EQ(name_in_force(), "other");
}

TEST(ModelOptions, ThatAreWrongEndTheDaemonAtOnce) {
  const TemporaryDirectory files;
  const ScopedVariable runtime("XDG_RUNTIME_DIR", files.path());
  const auto result = run_program({arbiterd_path(), "--model", "a="});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("\"a=\" names no file"));
}

}  // namespace
}  // namespace arbiter::test
