// Rule 8 of docs/hosts.md: all hosts switch to another model, or none does, where one says no or
// does not answer within 1 s; and what is said where neither is so.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/switch_everywhere.hpp"
#include "tests/cli/arbiter_program.hpp"
#include "tests/link/known_hosts.hpp"
#include "tests/link/scene.hpp"
#include "wire/link_call.hpp"
#include "wire/switch_request.hpp"

namespace arbiter::test {
namespace {

using cli::HostSwitch;
using testing::AllOf;
using testing::Each;
using testing::HasSubstr;

// After a link has joined its network, as it promises.
constexpr shm::Nanoseconds kAllAreHeard = 1'500'000'000;

// Three hosts. Each has the models "default" and "rest", and two have "dance", too.
class SwitchAll : public LoopbackHosts {
 protected:
  SwitchAll() {
    const auto models = files_.write("model.xml", kNoRules);
    const std::vector<std::string> rest{"--model", "rest=" + models};
    std::vector<std::string> both = rest;
    both.insert(both.end(), {"--model", "dance=" + models});
    for (const std::string name : {"arm", "base", "cam"}) {
      hosts_.emplace(
          std::piecewise_construct, std::forward_as_tuple(name),
          std::forward_as_tuple(name, runtime_, kNoRules, network(), std::vector<std::string>(),
                                name == "cam" ? rest : both));
    }
    for (const auto& [name, host] : hosts_) await_all(name);
  }

  // A release of what was never prepared harms nobody: who answers it is there.
  void await_all(const std::string& asking) const {
    const std::string nothing = wire::write_switch_request({1, "rest", {}});
    await([&] {
      try {
        return answered(ask(asking, wire::kReleaseVerb, nothing)) == hosts_.size();
      } catch (const wire::CallError&) {  // its link is not there yet
        return false;
      }
    });
  }

  static std::vector<wire::HostAnswer> ask(const std::string& at, const std::string& verb,
                                           const std::string& text) {
    return wire::LinkCall(at).ask_hosts({wire::kAllHosts, verb, text});
  }
  static std::size_t answered(const std::vector<wire::HostAnswer>& answers) {
    std::size_t count = 0;
    for (const auto& each : answers) count += each.outcome == wire::HostOutcome::kAnswered ? 1 : 0;
    return count;
  }
  static bool says(const ProgramResult& result, const std::string& text) {
    return (result.out + result.err).find(text) != std::string::npos;
  }
  // A second goes by on a machine that is busy, and so does a promise.
  static bool was_too_slow(const ProgramResult& result) {
    const auto texts = {"does not answer", "did not answer", "is gone, and was there within",
                        "it is not prepared for this switch",
                        "it has come after the others had prepared"};
    return std::any_of(texts.begin(), texts.end(),
                       [&](const char* text) { return says(result, text); });
  }
  // Again where somebody was merely too slow.
  static ProgramResult switch_all(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "switch");
    arguments.emplace_back("--all");
    for (;;) {
      ProgramResult result = arbiter(arguments);
      if (!was_too_slow(result) && !says(result, "busy")) return result;
    }
  }
  // Those that the link of arm knows, once all are up.
  wire::HostsDocument hosts_at_arm() const {
    return await_hosts("arm", [&](const wire::HostsDocument& hosts) {
      return std::all_of(hosts_.begin(), hosts_.end(), [&](const auto& each) {
        const auto* const known = hosts.find_host(each.first);
        return known != nullptr && known->is_up;
      });
    });
  }
  static ProgramResult switch_at_arm_once_it_has_joined() {
    for (;;) {
      ProgramResult result = arbiter({"switch", "rest", "--all", "--instance", "arm"});
      if (result.err.find("no arbiter-link") == std::string::npos &&
          result.err.find("has not joined") == std::string::npos &&
          result.err.find("did not answer within") == std::string::npos) {
        return result;
      }
    }
  }
  std::vector<std::string> in_force() {
    std::vector<std::string> names;
    for (auto& [name, host] : hosts_) names.push_back(host.daemon().status()["model"]["name"]);
    return names;
  }

  const TemporaryDirectory files_;
  std::map<std::string, Host> hosts_;
};

TEST_F(SwitchAll, AllHostsSwitch) {
  const auto result = switch_all({"rest", "--instance", "base"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("arm   switched after "), HasSubstr(": model 2\n"),
                                HasSubstr("3 hosts switched to \"rest\" one by one, within ")));
  EXPECT_THAT(in_force(), Each("rest"));
  const auto again = switch_all({"rest", "--instance", "base"});
  EXPECT_EQ(again.exit_code, 0) << again.out << again.err;
  EXPECT_EQ(again.out,
            "arm   has it already: model 2\nbase  has it already: model 2\n"
            "cam   has it already: model 2\n\"rest\" was in force already, so nothing has "
            "changed\n");
}

TEST_F(SwitchAll, IfOneCannotNoneDoes) {
  const auto result = switch_all({"dance", "--instance", "arm"});
  EXPECT_EQ(result.exit_code, 1) << result.out;
  EXPECT_THAT(result.out, HasSubstr("cam   not switched: there is no model \"dance\""));
  EXPECT_THAT(result.err, HasSubstr("no host has switched to \"dance\""));
  EXPECT_THAT(in_force(), Each("default"));
  // The others were released, and are not busy.
  const auto without = switch_all({"dance", "--instance", "base", "--without", "cam", "--json"});
  EXPECT_EQ(without.exit_code, 0) << without.out << without.err;
  const auto report = nlohmann::json::parse(without.out);
  EXPECT_EQ(report["ok"], true);
  ASSERT_EQ(report["hosts"].size(), 3u);
  EXPECT_EQ(report["hosts"][2]["outcome"], "left out");
  EXPECT_THAT(in_force(), testing::ElementsAre("dance", "dance", "default"));
}

TEST_F(SwitchAll, AHostThatIsSilentMeansThatNoneDoes) {
  hosts_.at("cam").link().stop();
  const auto result = arbiter({"switch", "rest", "--all", "--instance", "arm"});
  hosts_.at("cam").link().resume();
  EXPECT_EQ(result.exit_code, 1) << result.out;
  EXPECT_THAT(result.out, HasSubstr("cam   not switched: it"));
  EXPECT_THAT(in_force(), Each("default"));
}

TEST_F(SwitchAll, ALinkThatDiesBetweenPrepareAndCommitIsUnknownAndItsHostKeepsItsModel) {
  cli::SwitchEverywhere result;
  wire::SwitchRequest request{76, "rest", {}};
  bool is_killed = false;
  const auto ask_arm = [&](const std::string& verb, const std::string& text) {
    if (verb == wire::kCommitVerb) {
      hosts_.at("cam").link().kill();
      is_killed = true;
    }
    return ask("arm", verb, text);
  };
  for (;;) {
    ++request.attempt;
    try {
      result = cli::switch_everywhere(request, ask_arm, [] {
        return wire::read_hosts(wire::LinkCall("arm").ask({"", "hosts"}));
      });
    } catch (const wire::CallError&) {  // the link of arm was too slow
      result = {};
    }
    if (result.count(HostSwitch::Outcome::kSwitched) == 2) break;
    // On a busy machine an answer, or a commit, may have come too late.
    if (is_killed) hosts_.at("cam").start_link();
    is_killed = false;
    await_all("arm");
  }
  ASSERT_EQ(result.hosts.size(), 3u);
  EXPECT_EQ(result.hosts[2].outcome, HostSwitch::Outcome::kUnknown) << result.hosts[2].why;
  EXPECT_EQ(cli::exit_code_of(result), 3);
  await([&] { return in_force() == std::vector<std::string>{"rest", "rest", "default"}; });
  // Its next life was promised nothing.
  hosts_.at("cam").start_link();
  await_all("arm");
  EXPECT_EQ(answered(ask("arm", wire::kCommitVerb, wire::write_switch_request(request))), 0u);
  EXPECT_EQ(in_force()[2], "default");
}

// Whoever has prepared goes away: the hosts are busy for two seconds, and free again.
TEST_F(SwitchAll, AnOperatorWhoGoesAwayHoldsNobodyForLong) {
  await([&] { return answered(ask("arm", wire::kPrepareVerb, "000000000000004d\nrest")) == 3; });
  const auto second = arbiter({"switch", "rest", "--all", "--instance", "base"});
  // On a machine that stood still for two seconds, the promise is over.
  if (second.exit_code != 0) {
    if (second.exit_code != 3 && !was_too_slow(second)) {
      EXPECT_THAT(second.out, HasSubstr("not switched: busy: it is prepared for another switch"));
      EXPECT_THAT(in_force(), Each("default"));
    }
    await([] { return arbiter({"switch", "rest", "--all", "--instance", "base"}).exit_code == 0; });
  }
  EXPECT_THAT(in_force(), Each("rest"));
  EXPECT_EQ(answered(ask("arm", wire::kCommitVerb, "000000000000004d\nrest")), 0u) << "too late";
}

// Both ask at once: one wins at all hosts, or neither does.
TEST_F(SwitchAll, OfTwoOperatorsOneSwitchesOrNone) {
  for (int round = 0; round < 3; ++round) {
    const std::string before = in_force()[0];
    const auto switch_at = [](const std::string& host, const std::string& model) {
      return ChildProcess({std::string(ARBITER_PROGRAMS) + "/arbiter", "switch", model, "--all",
                           "--instance", host},
                          {}, {});
    };
    ChildProcess one = switch_at("arm", "rest");
    ChildProcess other = switch_at("base", "default");
    const int first = one.wait();
    const int second = other.wait();
    if (first == 3 || second == 3) continue;  // the machine stood still between two questions
    const auto names = in_force();
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), 1u)
        << "all hosts have one model";
    if (first != 0 && second != 0) {
      EXPECT_EQ(names[0], before);
    }
  }
}

// It knows nobody at first, and must not go ahead alone.
TEST_F(SwitchAll, ALinkThatHasJustJoinedItsNetworkPassesOverNobody) {
  bool are_all_in_time = false;
  while (!are_all_in_time && !HasFailure()) {
    hosts_.at("arm").link().kill();
    hosts_.at("arm").start_link();
    const ProgramResult result = switch_at_arm_once_it_has_joined();
    EXPECT_THAT(result.out, HasSubstr("arm "));
    // The others may be heard later than that on a busy machine.
    const wire::HostsDocument hosts = hosts_at_arm();
    const auto must_be_heard = [&](const char* host) {
      return hosts.find_host(host)->since <= hosts.find_this()->since + kAllAreHeard;
    };
    are_all_in_time = true;
    for (const char* host : {"base", "cam"}) {
      const bool is_asked = result.out.find(host + std::string(" ")) != std::string::npos;
      if (must_be_heard(host)) {
        EXPECT_TRUE(is_asked) << host << ": " << result.out << result.err;
      }
      are_all_in_time = are_all_in_time && is_asked;
    }
  }
}

TEST_F(SwitchAll, WithoutALinkItIsAnError) {
  hosts_.at("arm").link().kill();
  const auto result = arbiter({"switch", "rest", "--all", "--instance", "arm"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("arbiter-link"));
  EXPECT_THAT(in_force(), Each("default"));
}

}  // namespace
}  // namespace arbiter::test
