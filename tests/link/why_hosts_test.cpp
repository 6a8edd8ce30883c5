// What `arbiter why` says of ports and sources of other hosts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

TEST_F(WhyOfHosts, WhyOfOneThatDoesNotHaveThePortOpenSaysSo) {
  Host head("head", runtime_, motor_model("1000s"), network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  await_hosts("base", [](const wire::HostsDocument& hosts) {
    const auto* const here = hosts.find_host("base");
    return hosts.find_host("head") != nullptr && here != nullptr && here->inputs.size() == 1;
  });
  const ProgramResult of_head = run_arbiter("base", {"why", kMotor, "--host", "head"});
  EXPECT_EQ(of_head.exit_code, 0) << of_head.err;
  EXPECT_THAT(of_head.out,
              AllOf(HasSubstr("/Motor/speed:i is not open on host head, "),
                    HasSubstr("/Planner/speed:o wins; but nothing of it reaches the port: no "
                              "component has it open\n"),
                    HasSubstr("! it is open on host base, which decides it for its component: "
                              "arbiter why /Motor/speed:i --host base\n")));
  const json answer =
      json::parse(run_arbiter("base", {"why", kMotor, "--host", "head", "--json"}).out);
  EXPECT_EQ(answer["open"], false);
  EXPECT_EQ(answer["winner"], kPlanner);
  EXPECT_EQ(answer["nothing_comes_of_it"], "no component has it open");
  const json of_base =
      json::parse(run_arbiter("head", {"why", kMotor, "--host", "base", "--json"}).out);
  EXPECT_EQ(of_base["open"], true);
  EXPECT_EQ(of_base["nothing_comes_of_it"], nullptr);
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
    const std::string text = run_arbiter(instance, verb).out;
    EXPECT_THAT(text, AllOf(HasSubstr(pub + " had it open, and died "), death)) << instance;
  }
  head.link().kill();
  await_text("open any longer; host head, which it came from, is gone since ");
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
