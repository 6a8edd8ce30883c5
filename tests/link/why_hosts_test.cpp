// What `arbiter why` says of ports and sources of other hosts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/link/known_hosts.hpp"
#include "tests/link/robot.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

class WhyOfHosts : public LoopbackHosts {};

// What `arbiter why --follow --host` prints on base about a port of that host, until it has printed
// one change.
class FollowedPort {
 public:
  FollowedPort(const std::string& port, const std::string& host,
               const std::vector<std::string>& more) {
    std::vector<std::string> command{std::string(ARBITER_PROGRAMS) + "/arbiter",
                                     "why",
                                     port,
                                     "--follow",
                                     "--count",
                                     "1",
                                     "--host",
                                     host,
                                     "--instance",
                                     "base"};
    command.insert(command.end(), more.begin(), more.end());
    program_ = ChildProcess(command, {}, {-1, seen_.get(), -1});
  }
  [[nodiscard]] std::string text() const {
    return content_of("/proc/self/fd/" + std::to_string(seen_.get()));
  }
  void await_text(const std::string& what) const {
    await([&] { return text().find(what) != std::string::npos; });
  }
  int wait() { return program_.wait(); }
  [[nodiscard]] json line(std::size_t number) const {
    std::istringstream lines(text());
    std::string line;
    for (std::size_t i = 0; i <= number; ++i) std::getline(lines, line);
    return json::parse(line);
  }

 private:
  const shm::FileDescriptor seen_{::memfd_create("followed", MFD_CLOEXEC)};
  ChildProcess program_;
};

TEST_F(WhyOfHosts, WhyOfOneThatDoesNotHaveThePortOpenSaysSo) {
  Host head("head", runtime_, motor_model("1000s"), network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  await_inputs("base", "head", 0);
  await_inputs("base", "base", 1);
  await_inputs("head", "base", 1);
  const ProgramResult of_head = run_answered("base", {"why", kMotor, "--host", "head"});
  EXPECT_THAT(of_head.out,
              AllOf(HasSubstr("/Motor/speed:i is not open on host head, "),
                    HasSubstr("/Planner/speed:o wins; but nothing of it reaches the port: no "
                              "component has it open\n"),
                    HasSubstr("! it is open on host base, which decides it for its component: "
                              "arbiter why /Motor/speed:i --host base\n")));
  const json answer =
      json::parse(run_answered("base", {"why", kMotor, "--host", "head", "--json"}).out);
  EXPECT_EQ(answer["open"], false);
  EXPECT_EQ(answer["winner"], kPlanner);
  EXPECT_EQ(answer["nothing_comes_of_it"], "no component has it open");
  const json of_base =
      json::parse(run_answered("head", {"why", kMotor, "--host", "base", "--json"}).out);
  EXPECT_EQ(of_base["open"], true);
  EXPECT_EQ(of_base["nothing_comes_of_it"], nullptr);
}

// What keeps one of its behaviours out does not keep the connection out.
TEST_F(WhyOfHosts, AConnectionThatAnotherBehaviourWouldSelectIsNotSaidToBeKeptOut) {
  const std::string go = std::string("<config at='") + kMotor + "'>" + kPlanner + "</config>";
  const std::string model = "<behaviors><behavior name='A'>" + go +
                            "<condition>/go:o</condition></behavior><behavior name='B'>" + go;
  Host head("head", runtime_, model + "<condition>not /stop:o</condition></behavior></behaviors>",
            network());
  Host base("base", runtime_, model + "<condition>/stop:o</condition></behavior></behaviors>",
            network());
  await_inputs("base", "head", 0);
  await_inputs("head", "base", 0);
  const auto causes = [](const char* from, const char* of) {
    return json::parse(run_answered(from, {"why", kMotor, "--host", of, "--json"}).out)
        .at("connections")
        .at(0)
        .at("causes");
  };
  EXPECT_EQ(causes("base", "head"), json::array());
  const json kept_out = causes("head", "base");
  ASSERT_EQ(kept_out.size(), 2u);
  EXPECT_THAT(kept_out[0].get<std::string>(),
              testing::StartsWith("as behaviour \"A\" has it: kept out by the condition of "));
}

TEST_F(WhyOfHosts, OfAPortThatTwoHostsHaveOpenTheOtherIsNamed) {
  Host head("head", runtime_, motor_model("1000s"), network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Body of_head(head);
  Body of_base(base);
  await_inputs("base", "head", 1);
  await_inputs("base", "base", 1);
  const char* const kOther =
      "\n  ! it is also open on host head, and each of them decides it by itself: open it on one "
      "only; arbiter why /Motor/speed:i --host head\n";
  // A link that is slow today is left out.
  await([&] { return run_arbiter("base", {"why", kMotor}).out.find(kOther) != std::string::npos; });
  await([] {
    const json answer = json::parse(run_arbiter("base", {"why", kMotor, "--json"}).out);
    return answer["also_open_on"] == json::array({"head"});
  });
  EXPECT_THAT(run_answered("base", {"why", kMotor, "--host", "head"}).out,
              HasSubstr("\n  ! it is also open on host base, "));
}

// The same is said as without --follow, and in JSON each line is as of a port of this host.
TEST_F(WhyOfHosts, WhoFollowsOneThatDoesNotHaveThePortOpenIsToldSo) {
  Host head("head", runtime_, motor_model("1000s"), network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  await_inputs("base", "head", 0);
  await_inputs("base", "base", 1);
  const FollowedPort text(kMotor, "head", {});
  FollowedPort lines(kMotor, "head", {"--json"});
  text.await_text("is not open on host head: /Planner/speed:o, by model 1;");
  text.await_text("! it is open on host base, which decides it for its component");
  lines.await_text("}\n");
  const json first = lines.line(0);
  EXPECT_EQ(first["open"], false);
  EXPECT_EQ(first["mentioned"], true);
  EXPECT_EQ(first["arbitrated"], true);
  EXPECT_EQ(first["winner"], kPlanner);
  planner.port().deactivate();
  text.await_text("/Planner/speed:o -> idle  because /Planner/speed:o became inactive\n");
  EXPECT_EQ(lines.wait(), 0);
  const json change = lines.line(1);
  EXPECT_EQ(change["old"], kPlanner);
  EXPECT_EQ(change["winner"], nullptr);
  EXPECT_EQ(change["because"], json::parse(R"([{"source": "/Planner/speed:o",
                                               "became": "inactive", "at_ns": null}])"));
  EXPECT_EQ(change["model"], nullptr);
  EXPECT_EQ(change["old_loses"], nullptr);
}

TEST_F(WhyOfHosts, WhatHasBecomeOfASourceOnItsHostIsSaid) {
  Host head("head", runtime_, motor_model("1000s"), network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Body body(base);
  const auto of_base = [&] { return run_arbiter("base", {"why", kMotor}).out; };
  const auto await_text = [&](const std::string& text) {
    await([&] { return of_base().find(text) != std::string::npos; });
  };
  {
    Planner planner(head);
    body.drive(planner);
  }
  await_text(
      "open any longer; host head, which it came from, is heard and nobody has it open there; no "
      "death is known, so its component closed it");
  ChildProcess planner({std::string(ARBITER_PROGRAMS) + "/arbiter", "pub", kPlanner, "--rate", "50",
                        "--instance", "head"},
                       {}, {});
  const std::string pub = "arbiter-pub (pid " + std::to_string(planner.pid()) + ")";
  base.await_described(kPlanner, "host head");
  planner.kill();
  const testing::Matcher<std::string> death = testing::ContainsRegex(
      "arbiter-pub \\(pid [0-9]+\\) had it open, and died [0-9.]+ .?s ago\n");
  await_text("open any longer; on host head " + pub + " had it open, and died ");
  EXPECT_THAT(of_base(), death);
  // There, too, whoever asks.
  for (const auto& [instance, verb] :
       {std::pair<std::string, std::vector<std::string>>{"base", {"why", kMotor, "--host", "head"}},
        {"base", {"status", "--all"}},
        {"head", {"status"}}}) {
    const std::string text = run_answered(instance, verb).out;
    EXPECT_THAT(text, AllOf(HasSubstr(pub + " had it open, and died "), death)) << instance;
  }
  head.link().kill();
  await_text("open any longer; host head, which it came from, has been gone for ");
}

TEST_F(WhyOfHosts, ASourceThatAComponentHereHadOpenSinceCameFromNoOtherHost) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Body body(base);
  {
    Planner planner(head);
    body.drive(planner);
  }
  await_hosts("base", [](const wire::HostsDocument& hosts) {
    const auto* const import = hosts.find_import(kPlanner);
    return import != nullptr && import->is_gone();
  });
  {
    Planner near(base);
    await_hosts("base", [](const wire::HostsDocument& hosts) {
      const auto* const import = hosts.find_import(kPlanner);
      return import == nullptr || import->is_open_here;
    });
  }
  await_hosts("base", [](const wire::HostsDocument& hosts) {
    return hosts.find_import(kPlanner) == nullptr;
  });
}

}  // namespace
}  // namespace arbiter::test
