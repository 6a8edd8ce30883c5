// Rules 1, 6 and 8 of docs/hosts.md: what links know of each other and can be asked (an input port
// or a source that is open on two hosts, models, round trips; silent after 1 s), and how the tool
// shows it: real daemons, real links, the real program.
#include "wire/hosts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>

#include <memory>

#include "tests/link/known_hosts.hpp"
#include "tests/link/robot.hpp"
#include "tests/support/page_tables.hpp"
#include "wire/link_call.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using wire::HostOutcome;

class KnownHosts : public LoopbackHosts {};

std::string text_of_hosts(const wire::HostsDocument& hosts) {
  std::string text;
  for (const auto& each : hosts.disagreements) text += each.text + "\n";
  return text;
}

TEST_F(KnownHosts, KnowEachOthersModelsPortsAndRoundTrips) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  const auto hosts = await_hosts("head", [](const wire::HostsDocument& now) {
    const auto* const other = now.find_host("base");
    return other != nullptr && other->round_trip && other->imports == 1 && other->input_count == 1;
  });
  const wire::HostStatus& here = *hosts.find_this();
  const wire::HostStatus& other = *hosts.find_host("base");
  EXPECT_EQ(here.host, "head");
  EXPECT_THAT(here.outputs, ElementsAre(kPlanner));
  EXPECT_TRUE(other.has_daemon);
  EXPECT_EQ(other.instance, "base");
  EXPECT_THAT(other.inputs, ElementsAre(kMotor));
  EXPECT_THAT(other.outputs, ElementsAre(kHold)) << "an import is not offered";
  ASSERT_TRUE(other.model && here.model);
  EXPECT_NE(other.model->digest, here.model->digest);
  EXPECT_EQ(here.model->digest.size(), 16U);
  EXPECT_GT(*other.round_trip, 0);
  const auto of_base = hosts_of("base");
  const wire::ImportStatus* const import = of_base.find_import(kPlanner);
  ASSERT_NE(import, nullptr);
  EXPECT_EQ(import->host, "head");
  EXPECT_TRUE(import->is_open);
}

TEST_F(KnownHosts, AnInputPortThatIsOpenOnTwoIsAnErrorThatAllOfThemName) {
  Host head("head", runtime_, motor_model("1000s"), network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Node body = base.node("body");
  auto motor = body.input_port<Speed>(kMotor);
  Node other = head.node("other");
  auto same = std::make_optional(other.input_port<Speed>(kMotor));
  const std::string error = "the input port /Motor/speed:i is open on the hosts base and head";
  for (Host* const host : {&head, &base}) host->see(error);
  for (const std::string instance : {"head", "base"}) {
    EXPECT_THAT(text_of_hosts(hosts_of(instance)), HasSubstr(error));
    const ProgramResult shown = run_arbiter(instance, {"hosts"});
    EXPECT_EQ(shown.exit_code, 1);
    EXPECT_THAT(shown.out, HasSubstr("ERROR: " + error));
    await([&] {  // a link that is slow today is left out, and that is said
      return run_arbiter(instance, {"status"}).out.find("ERROR: " + error) != std::string::npos;
    });
    await([&] { return run_arbiter(instance, {"doctor"}).out.find(error) != std::string::npos; });
  }
  same.reset();
  await_hosts("base", [](const auto& hosts) { return hosts.disagreements.empty(); });
  EXPECT_EQ(run_arbiter("base", {"hosts"}).exit_code, 0);
  EXPECT_THAT(run_arbiter("base", {"status"}).out, Not(HasSubstr("ERROR")));
}

TEST_F(KnownHosts, ASourceThatIsOpenOnTwoIsNamedThoughNobodyImportsIt) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, kNoRules, network());
  Planner near(head);
  Planner far(base);
  // Each by itself, once it has stood there for a while.
  for (Host* const each : {&head, &base}) {
    each->see("the source /Planner/speed:o is open on the hosts base and head");
  }
  const ProgramResult shown = run_arbiter("base", {"hosts"});
  EXPECT_THAT(shown.out, HasSubstr("warning: the source /Planner/speed:o is open on"));
  EXPECT_EQ(shown.exit_code, 0);
}

TEST_F(KnownHosts, OnesLinkThatEndsIsListedAsGone) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, kNoRules, network());
  await_host("base", "head");
  head.link().signal(SIGTERM);
  ASSERT_EQ(head.link().wait(), 0);
  await_hosts("base", [](const auto& hosts) { return !hosts.find_host("head")->is_up; });
  EXPECT_THAT(run_arbiter("base", {"hosts"}).out, HasSubstr("gone "));
  const ProgramResult all = run_arbiter("base", {"status", "--all"});
  EXPECT_EQ(all.exit_code, 1);
  EXPECT_THAT(all.err, HasSubstr("host head is gone"));
  head.start_link();
  await_host("base", "head");
}

TEST_F(KnownHosts, AreAskedForTheirStatus) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  await_host("base", "head");
  await([&] {
    const ProgramResult all = run_arbiter("base", {"status", "--all"});
    return all.exit_code == 0 && all.out.find(kPlanner) != std::string::npos &&
           all.out.find("== host base (this one) ==") != std::string::npos &&
           all.out.find("== host head (round trip ") != std::string::npos;
  });
  const json document = json::parse(run_answered("base", {"status", "--all", "--json"}).out);
  ASSERT_EQ(document["hosts"].size(), 2U);
  EXPECT_EQ(document["hosts"][1]["host"], "head");
  EXPECT_EQ(document["hosts"][1]["outcome"], "answered");
  EXPECT_TRUE(document["hosts"][0]["round_trip_ns"].is_null());
  EXPECT_TRUE(document["hosts"][1].contains("round_trip_ns"));
  EXPECT_EQ(document["hosts"][1]["status"]["instance"], "head");
}

TEST_F(KnownHosts, WhyIsAskedOfTheOneThatDecides) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  body.hold().publish(Speed{0});
  const auto why = [](const std::string& instance, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"why", kMotor});
    return run_arbiter(instance, more);
  };
  await([&] { return why("head").out.find("is decided on host base") != std::string::npos; });
  await([&] { return why("head").out.find("comes from host head") != std::string::npos; });
  const ProgramResult from_afar = why("head");
  EXPECT_EQ(from_afar.exit_code, 0);
  EXPECT_THAT(from_afar.out, AllOf(HasSubstr("/Planner/speed:o wins"),
                                   HasSubstr("/Hold/speed:o  active  [body]\n  inhibited by "
                                             "behaviour \"Drive\"")));
  const json document = json::parse(why("head", {"--json"}).out);
  EXPECT_EQ(document["host"], "base");
  EXPECT_EQ(document["winner"], kPlanner);
  std::vector<std::string> fields;  // as the page has them
  for (const PageRow& row :
       rows_of(content_of(ARBITER_SOURCE "/docs/hosts.md"), {"field of `why`", "value"})) {
    const std::string field = quoted(row.cells.at(0)).at(0);
    EXPECT_TRUE(document.contains(field)) << field;
    fields.push_back(field);
    if (field != "connections") continue;
    const json& connection = document[field].at(0);
    for (const std::string& part : quoted(row.cells.at(1))) {
      EXPECT_TRUE(connection.contains(part)) << part;
    }
    EXPECT_EQ(connection.size(), quoted(row.cells.at(1)).size());
  }
  EXPECT_EQ(fields.size(), document.size());
  await([&] {  // the link says a little later what it has opened
    return why("base").out.find("From other hosts:\n  /Planner/speed:o  from host head") !=
           std::string::npos;
  });
  EXPECT_THAT(why("base", {"--host", "base"}).out, HasSubstr("From other hosts:"));
  EXPECT_THAT(why("head", {kHold}).out,
              AllOf(HasSubstr("/Hold/speed:o  active"), Not(HasSubstr("/Planner/speed:o  "))));
  EXPECT_EQ(why("head", {"/Other:o"}).exit_code, 1);
  const ProgramResult nobody = why("head", {"--host", "nobody"});
  EXPECT_EQ(nobody.exit_code, 1);
  EXPECT_THAT(nobody.err, HasSubstr("no host is called \"nobody\""));
  await([] {
    return run_arbiter("head", {"why", "/Other:i", "--host", "base"})
               .err.find("host base has no input port /Other:i") != std::string::npos;
  });
}

TEST_F(KnownHosts, TheWinnersOfAPortOfAnotherOneAreFollowed) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  await([&] {
    return run_arbiter("head", {"why", kMotor}).out.find("is decided on host base") !=
           std::string::npos;
  });
  const shm::FileDescriptor seen(::memfd_create("follow", MFD_CLOEXEC));
  ChildProcess follow({std::string(ARBITER_PROGRAMS) + "/arbiter", "why", kMotor, "--follow",
                       "--count", "1", "--instance", "head"},
                      {}, {-1, seen.get(), seen.get()});
  const auto text = [&] { return content_of("/proc/self/fd/" + std::to_string(seen.get())); };
  const auto await_text = [&](const std::string& what) {
    await([&] { return text().find(what) != std::string::npos; });
  };
  await_text("on host base: /Planner/speed:o");
  head.link().kill();
  await_text("no arbiter-link of instance \"head\" runs");
  head.start_link();
  await_text("host base answers");
  body.drive(planner);
  planner.port().deactivate();
  EXPECT_EQ(follow.wait(), 0);
  EXPECT_THAT(text(), HasSubstr("/Planner/speed:o -> idle  because /Planner/speed:o became "
                                "inactive"));
}

TEST_F(KnownHosts, AreBoxesInALivePicture) {
  Host head("head", runtime_, source_model("1000s"), network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  const auto drawn_on_base = [](const std::string& what) {
    const std::string dot =
        run_arbiter("base", {"graph", "--live", "--view", "connections", "--format", "dot"}).out;
    return dot.find(what) != std::string::npos;
  };
  await([&] { return drawn_on_base("<B>head</B>") && drawn_on_base("round trip "); });
  // As its own host knows it, with what this one knows of its age.
  await([&] { return drawn_on_base("● /Planner/speed:o ("); });
  EXPECT_TRUE(drawn_on_base("▶ /Planner/speed:o"));
  head.daemon().process().stop();
  await([&] { return !drawn_on_base("● /Planner/speed:o ("); });
  EXPECT_TRUE(drawn_on_base("▶ /Planner/speed:o")) << "decided here";
  head.daemon().process().resume();
  await([&] { return drawn_on_base("● /Planner/speed:o ("); });
  head.link().signal(SIGKILL);
  await([&] { return drawn_on_base("gone for "); });
}

// Its link is there, and the daemon behind it does not answer.
TEST_F(KnownHosts, OneWhoseDaemonIsStoppedIsNamed) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, kNoRules, network());
  await_host("base", "head");
  head.daemon().process().stop();
  const ProgramResult all = run_arbiter("base", {"status", "--all"});
  head.daemon().process().resume();
  EXPECT_EQ(all.exit_code, 1);
  EXPECT_THAT(all.err, HasSubstr("host head "));
  EXPECT_THAT(all.out, HasSubstr("== host base (this one) =="));
  await([&] { return run_arbiter("base", {"status", "--all"}).exit_code == 0; });
}

TEST_F(KnownHosts, OneWhoseLinkIsStoppedIsSilent) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, kNoRules, network());
  await_host("base", "head");
  head.link().stop();
  wire::LinkCall link("base");
  const auto answers = link.ask_hosts({"head", "status"});
  head.link().resume();
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_TRUE(answers[0].outcome == HostOutcome::kSilent ||
              answers[0].outcome == HostOutcome::kGone)
      << "its lease may have run out on a slow machine";
  await([&] {
    const auto now = link.ask_hosts({"head", "status"});
    return now.at(0).outcome == HostOutcome::kAnswered;
  });
}

TEST_F(KnownHosts, AnswerOnlyWhatTheyCanBeAsked) {
  Host base("base", runtime_, kNoRules, network());
  hosts_of("base");
  wire::LinkCall link("base");
  const auto refusal = [&](const wire::LinkQuestion& question) -> std::string {
    try {
      return "answered: " + link.ask(question);
    } catch (const wire::RefusedError& error) {
      return error.what();
    }
  };
  EXPECT_THAT(refusal({"", "shutdown"}), HasSubstr("links cannot be asked for \"shutdown\""));
  EXPECT_THAT(refusal({"nobody", "status"}), HasSubstr("no host is called \"nobody\""));
  EXPECT_THAT(refusal({"", "status", std::string(5000, 'x')}), HasSubstr("too much to ask"));
  EXPECT_EQ(link.ask_hosts({"base", "model"}).at(0).outcome, HostOutcome::kAnswered);
}

TEST_F(KnownHosts, TheToolSaysWhereNoLinkRuns) {
  Daemon daemon;
  for (const std::vector<std::string>& verb :
       {std::vector<std::string>{"hosts"}, {"status", "--all"}}) {
    const ProgramResult result = arbiter(verb);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, AllOf(HasSubstr("no arbiter-link of instance \"test\" runs"),
                                  HasSubstr("start one with: arbiter-link --interface NAME")));
  }
}

// A program of this host that is up to no good.
class Nuisance {
 public:
  explicit Nuisance(const std::string& instance) {
    std::string why_not;
    auto socket = wire::connect_to_link(instance, why_not);
    if (socket) socket_ = std::move(*socket);
  }
  void say(const std::string& bytes) const {
    static_cast<void>(::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL));
  }
  // Empty: it has hung up.
  [[nodiscard]] std::string answer() const {
    std::string bytes(wire::kMaxLinkPacket, '\0');
    const ssize_t size = ::recv(socket_.get(), bytes.data(), bytes.size(), 0);
    bytes.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
    return bytes;
  }

 private:
  shm::FileDescriptor socket_;
};

TEST_F(KnownHosts, ProgramsThatSayNonsenseAreTold) {
  Host base("base", runtime_, kNoRules, network());
  hosts_of("base");
  const Nuisance nuisance("base");
  nuisance.say("{");
  EXPECT_THAT(nuisance.answer(), HasSubstr("not JSON"));
  nuisance.say(R"({"host": 5, "verb": "hosts", "argument": ""})");
  EXPECT_THAT(nuisance.answer(), HasSubstr("host"));
  nuisance.say(std::string(20'000, '['));
  EXPECT_THAT(nuisance.answer(), Not(IsEmpty()));
  EXPECT_EQ(hosts_of("base").host, "base");
}

TEST_F(KnownHosts, ProgramsThatSayNothingHoldUpNobodyButTheirUser) {
  Host base("base", runtime_, kNoRules, network());
  hosts_of("base");
  std::vector<std::unique_ptr<Nuisance>> silent;
  for (int i = 0; i < 8; ++i) silent.push_back(std::make_unique<Nuisance>("base"));
  await([] { return Nuisance("base").answer().find("too many programs") != std::string::npos; });
  base.see("host base, on");
  silent.clear();
  await_hosts("base", [](const auto& hosts) { return hosts.host == "base"; });
}

TEST_F(KnownHosts, APolicyThatForbidsToObserveHoldsForTheLinkToo) {
  const TemporaryDirectory files;
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, kNoRules, network());
  await_host("base", "head");
  // In place of the daemon that let the link in.
  Daemon::Options options;
  options.instance = "other";
  options.runtime_directory = runtime_.path();
  options.arguments = {"--policy", files.write("policy", "deny everyone observe\n")};
  Daemon strict(kNoRules, options);
  ChildProcess link({std::string(ARBITER_PROGRAMS) + "/arbiter-link", "--instance", "other",
                     "--host", "other", "--domain", std::to_string(domain_.number())},
                    {}, {});
  await([] {
    const std::string err = run_arbiter("other", {"hosts"}).err;
    return err.find("may not observe") != std::string::npos;
  });
  const auto of_other = [] {
    wire::LinkCall call("base");
    return call.ask_hosts({"other", "status"}).at(0);
  };
  await_host("base", "other");
  const wire::HostAnswer answer = of_other();
  EXPECT_EQ(answer.outcome, HostOutcome::kRefused);
  EXPECT_THAT(answer.text, HasSubstr("may not observe"));
  link.signal(SIGTERM);
  EXPECT_EQ(link.wait(), 0);
}

}  // namespace
}  // namespace arbiter::test
