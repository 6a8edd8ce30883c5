// What a policy file may say, and what it means.
#include "service/policy/policy.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "service/policy/unmatched.hpp"

namespace arbiter::service {
namespace {

using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr uid_t kOwner = 500, kAlice = 1000, kBob = 1001;
constexpr gid_t kOperators = 2000, kGuests = 2001;

const Accounts kAccounts{[](const std::string& name) -> std::optional<uid_t> {
                           if (name == "alice") return kAlice;
                           if (name == "bob") return kBob;
                           if (name == "root") return 0;
                           return {};
                         },
                         [](const std::string& name) -> std::optional<gid_t> {
                           if (name == "operators") return kOperators;
                           if (name == "guests") return kGuests;
                           return {};
                         }};

// Whoever is refused does not know in which directory the daemon was given its files.
const std::string kPath = std::filesystem::current_path().string() + "/policy";

const Identity kRoot{0, {0}};
const Identity kTheOwner{kOwner, {kOwner}};
const Identity kOperator{kAlice, {kAlice, 7, kOperators}};
const Identity kOther{kBob, {kBob}};

struct Read {
  Policy policy;
  std::vector<std::string> findings;  // "2:7 error unknown-user: …"
};

Read read(const std::string& text) {
  rules::Diagnostics diagnostics;
  const rules::TextFile file("policy", text);
  Read result{Policy::parse(file, kOwner, kAccounts, diagnostics), {}};
  for (const auto& item : diagnostics.items()) {
    result.findings.push_back(std::to_string(item.where.line) + ":" +
                              std::to_string(item.where.column) +
                              (item.severity == rules::Severity::kError ? " error " : " warning ") +
                              item.code + ": " + item.message);
  }
  return result;
}

Policy good(const std::string& text) {
  Read result = read(text);
  EXPECT_THAT(result.findings, IsEmpty()) << text;
  return std::move(result.policy);
}

bool may(const Policy& policy, const Identity& who, Action action, std::string_view port = {}) {
  return policy.may(who, action, port).allowed;
}

TEST(Policy, TheFirstLineThatMatchesDecides) {
  const std::string allow = "allow user alice output /Arm/*\n",
                    deny = "deny everyone output /Arm/x\n";
  EXPECT_TRUE(may(good(allow + deny), kOperator, Action::kOutput, "/Arm/x"));
  EXPECT_FALSE(may(good(deny + allow), kOperator, Action::kOutput, "/Arm/x"));
  EXPECT_TRUE(may(good(deny + allow), kOperator, Action::kOutput, "/Arm/y"));
}

TEST(Policy, WhatNoLineAllowsIsRefused) {
  const Policy policy = good("allow user alice output /Arm/*");
  EXPECT_FALSE(may(policy, kOther, Action::kOutput, "/Arm/x"));
  EXPECT_FALSE(may(policy, kOperator, Action::kOutput, "/Leg/x"));
  EXPECT_FALSE(may(policy, kOperator, Action::kInput, "/Arm/x"));
  EXPECT_FALSE(may(policy, kOperator, Action::kDeactivate, "/Arm/x"));
  for (const Action action : {Action::kObserve, Action::kReload, Action::kStop}) {
    EXPECT_FALSE(may(policy, kOperator, action));
  }
}

TEST(Policy, RootAndTheOwnerMayWhereNoLineSaysOtherwise) {
  const Policy policy =
      good("deny everyone stop\ndeny owner output /x\nallow user bob reload # late");
  for (const Identity& who : {kRoot, kTheOwner}) {
    EXPECT_TRUE(may(policy, who, Action::kReload));
    EXPECT_TRUE(may(policy, who, Action::kInput, "/any"));
    EXPECT_FALSE(may(policy, who, Action::kStop)) << "a line that names everyone means them, too";
  }
  EXPECT_FALSE(may(policy, kTheOwner, Action::kOutput, "/x"));
  EXPECT_TRUE(may(policy, kRoot, Action::kOutput, "/x"));
}

TEST(Policy, AGroupIsAnyOfTheGroupsThatAProcessHas) {
  const Policy policy = good(
      "deny group guests all\nallow group operators reload,stop\n"
      "allow group 7 observe");
  EXPECT_TRUE(may(policy, kOperator, Action::kStop));
  EXPECT_TRUE(may(policy, kOperator, Action::kObserve));
  EXPECT_FALSE(may(policy, kOther, Action::kStop));
  EXPECT_FALSE(may(policy, {kAlice, {kOperators, kGuests}}, Action::kStop));
  EXPECT_FALSE(may(policy, {kOperators, {}}, Action::kStop)) << "a user's number is no group's";
}

TEST(Policy, AnActionIsAllowedByItself) {
  const std::vector<std::pair<std::string, Action>> actions{
      {"output *", Action::kOutput},         {"input *", Action::kInput},
      {"deactivate *", Action::kDeactivate}, {"observe", Action::kObserve},
      {"reload", Action::kReload},           {"stop", Action::kStop},
      {"replay *", Action::kReplay},         {"tap *", Action::kTap}};
  for (const auto& [text, allowed] : actions) {
    const Policy policy = good("allow everyone " + text);
    for (const auto& [other, action] : actions) {
      EXPECT_EQ(may(policy, kOther, action, "/x"), action == allowed) << text << " and " << other;
    }
    EXPECT_TRUE(may(good("allow everyone all"), kOther, allowed, "/x"));
  }
}

TEST(Policy, SeveralActionsAndPatternsStandOnOneLine) {
  const Policy policy = good("allow user alice output,input /a:o */b \t /c* \r\n");
  for (const Action action : {Action::kOutput, Action::kInput}) {
    for (const char* port : {"/a:o", "/x/y/b", "/c", "/c/d"}) {
      EXPECT_TRUE(may(policy, kOperator, action, port)) << port;
    }
    for (const char* port : {"/a:o/", "/b/c", "/a"}) {
      EXPECT_FALSE(may(policy, kOperator, action, port)) << port;
    }
  }
}

TEST(Policy, TellsTheLineThatRefuses) {
  const Policy policy = good("# the arm\n\n  deny   everyone\toutput /Arm/* /Leg/* # not yours\n");
  EXPECT_EQ(policy.may(kOther, Action::kOutput, "/Leg/x").reason,
            kPath + ":3 says: deny everyone output /Arm/* /Leg/*");
  EXPECT_EQ(policy.may(kOther, Action::kStop).reason, "no line of " + kPath + " allows it");
}

TEST(Policy, SaysWhereALineIsMissingThatWouldAllowIt) {
  const std::vector<std::pair<std::string, Action>> actions{
      {"output /x:o", Action::kOutput},
      {"input /x:o", Action::kInput},
      {"deactivate /x:o", Action::kDeactivate},
      {"observe", Action::kObserve},
      {"reload", Action::kReload},
      {"switch", Action::kSwitch},
      {"stop", Action::kStop},
      {"replay /x:o", Action::kReplay},
      {"tap /x:o", Action::kTap}};
  const std::string others = "allow user alice all\n";
  for (const auto& [text, action] : actions) {
    EXPECT_TRUE(good(others).may(kOther, action, "/x:o").lacks_line) << text;
    const std::string line = line_that_allows("bob", action, "/x:o");
    EXPECT_EQ(line, "allow user bob " + text);
    EXPECT_TRUE(may(good(others + line), kOther, action, "/x:o")) << line;
  }
  EXPECT_EQ(line_that_allows("bob", Action::kTap, "/x*"), "") << "it would allow others, too";
  EXPECT_FALSE(good("deny everyone stop").may(kOther, Action::kStop).lacks_line);
  EXPECT_FALSE(Policy(kOwner).may(kOther, Action::kStop).lacks_line) << "there is no file";
}

TEST(Policy, IsTheSameWhereItsRulesAre) {
  const Policy policy = good("allow user alice output,input /a:o\n");
  EXPECT_TRUE(policy.has_rules_of(good("# hers\n\nallow  user 1000 output,input /a:o # late\n")));
  for (const std::string other :
       {"deny user alice output,input /a:o", "allow user bob output,input /a:o",
        "allow user alice output /a:o", "allow user alice output,input /a:o /b:o",
        "allow user alice output,input /b:o"}) {
    EXPECT_FALSE(policy.has_rules_of(good(other))) << other;
    EXPECT_FALSE(good(other).has_rules_of(policy)) << other;
  }
}

TEST(Policy, WithoutAFileEveryoneMayOpenPortsAndObserve) {
  const Policy policy(kOwner);
  for (const Action action : {Action::kOutput, Action::kInput, Action::kDeactivate}) {
    EXPECT_TRUE(may(policy, kOther, action, "/x"));
  }
  EXPECT_TRUE(may(policy, kOther, Action::kObserve));
  for (const Action action : {Action::kReload, Action::kStop, Action::kReplay, Action::kTap}) {
    EXPECT_FALSE(may(policy, kOther, action));
    EXPECT_THAT(policy.may(kOther, action).reason, HasSubstr("--policy"));
    EXPECT_TRUE(may(policy, kRoot, action));
    EXPECT_TRUE(may(policy, kTheOwner, action));
  }
}

TEST(Policy, TellsEveryMistakeWithItsPlace) {
  const std::vector<std::pair<std::string, std::string>> mistakes{
      {"alow user alice stop",
       "1:1 error unknown-word: \"alow\" is neither allow nor deny; did you"},
      {"allow", "1:6 error unknown-word: the line ends where it must say who"},
      {"allow alice stop", "1:7 error unknown-word: \"alice\" stands where it must say who"},
      {"allow user", "1:11 error unknown-user: user must be followed by a name"},
      {"allow user carol stop", "1:12 error unknown-user: this machine has no user \"carol\""},
      {"allow group crew stop", "1:13 error unknown-group: this machine has no group \"crew\""},
      {"allow user 4294967295 stop", "1:12 error unknown-user"},
      {"allow user alice", "1:17 error unknown-action: the line ends where it must say what"},
      {"allow user alice stopp", "1:18 error unknown-action: \"stopp\" is no action; did you"},
      {"allow user alice stop,", "1:23 error unknown-action"},
      {"allow user alice stop,all", "1:23 error unknown-action: \"all\" is no action; all stands"},
      {"allow user alice stop /x", "1:23 error stray-word: \"/x\" stands behind \"stop\""},
      {"allow user alice all /Arm/*",
       "1:22 error stray-word: \"/Arm/*\" stands behind \"all\", which is on every port and takes "
       "no "
       "pattern; write #"},
      {"allow user alice stop,output /x", "1:18 error mixed-actions"},
      {"allow user alice output", "1:24 error missing-glob"},
      {"allow user alice output # /x", "1:29 error missing-glob"},
      {"allow user alice output Arm/*", "1:25 error invalid-glob"},
      {"allow user alice output /" + std::string(255, 'a'), "1:25 error name-too-long"},
      {"", "1:1 error empty-file"},
      {"# nothing\n\n", "1:1 error empty-file"},
      {std::string("allow user alice stop\0", 22), "1:22 error invalid-character"},
      {"allow user alice\xff stop", "1:17 error invalid-character"},
  };
  for (const auto& [text, finding] : mistakes) {
    const Read result = read(text);
    ASSERT_EQ(result.findings.size(), 1u) << text;
    EXPECT_THAT(result.findings[0], testing::StartsWith(finding)) << text;
  }
  EXPECT_EQ(read("allow\nallow user carol stop\ndeny nobody stop\n").findings.size(), 3u);
}

TEST(Policy, WarnsOfALineThatNeverCounts) {
  const std::vector<std::string> shadowed{
      "deny everyone output /Arm/*\nallow user alice output /Arm/x",
      "allow user alice stop\nallow user 1000 stop",
      "allow user alice output,input *\nallow user alice input /a*b",
      "allow user alice all\ndeny user alice stop",
  };
  for (const std::string& text : shadowed) {
    const Read result = read(text);
    ASSERT_EQ(result.findings.size(), 1u) << text;
    EXPECT_THAT(result.findings[0], testing::StartsWith("2:")) << text;
    EXPECT_THAT(result.findings[0],
                HasSubstr("warning never-applies: this never counts, for line 1"));
  }
  good(
      "allow user alice output /Arm/x\ndeny everyone output /Arm/*\n"
      "allow user alice output /Leg*\nallow group 1000 stop\nallow user alice stop,reload\n"
      "allow user bob input /a*\ndeny user bob input /b*\nallow user bob input /*b");
}

// As those who wrote the policy find it: "no model has …", with what was meant.
std::vector<std::string> unmatched(const std::string& text, NamedPorts ports) {
  rules::Diagnostics diagnostics;
  find_unmatched(good(text), std::move(ports), diagnostics);
  std::vector<std::string> findings;
  for (const auto& item : diagnostics.items()) {
    EXPECT_EQ(item.severity, rules::Severity::kNote);
    EXPECT_EQ(item.code, "no-such-port");
    findings.push_back(std::to_string(item.where.line) + ":" + std::to_string(item.where.column) +
                       ": " + item.message);
  }
  return findings;
}

TEST(Policy, NotesAPatternThatFitsNoPortOfAModel) {
  const NamedPorts ports{{"/emergency:o", "/Arm/pos:o", "/Gaze:o"}, {"/Arm/pos:i", "/Gaze:i"}};
  EXPECT_THAT(
      unmatched("allow user alice output /emergncy:o /Arm/*\n"
                "deny everyone output,deactivate /emergency:o",
                ports),
      ElementsAre("1:25: no model names an output port that fits \"/emergncy:o\"; did you mean "
                  "\"/emergency:o\"?"));
  EXPECT_THAT(
      unmatched("allow user alice input /Leg/*\nallow user alice tap *:i /L*:?", ports),
      ElementsAre("1:24: no model names an input port that fits \"/Leg/*\"; correct it, unless "
                  "components open such a port that no model needs",
                  "2:26: no model names a port that fits \"/L*:?\"; correct it, unless components "
                  "open such a port that no model needs"));
  // Of a pattern, what stands before the first '*'.
  const NamedPorts joystick{{"/Operator/cmd:o", "/Operator/deadman:o", "/Nav/vel:o"}, {}};
  EXPECT_THAT(unmatched("allow user alice output /Opertor/* /operator*", joystick),
              ElementsAre(EndsWith("\"/Opertor/*\"; did you mean \"/Operator/*\"?"),
                          EndsWith("\"/operator*\"; did you mean \"/Operator*\"?")));
  // It must fit then; and what stands behind the '*' may be wrong, too.
  EXPECT_THAT(
      unmatched("allow user alice output /Opertor/*:i /Operator/x* /Lidar/* /Operator/cnd*:o",
                joystick),
      AllOf(SizeIs(4), Each(EndsWith("open such a port that no model needs"))));
  // Each kind of port has names of its own.
  EXPECT_THAT(unmatched("allow user alice input /Gaze:o\nallow user alice replay /Gaze:i", ports),
              ElementsAre(HasSubstr("an input port that fits \"/Gaze:o\"; did you mean "
                                    "\"/Gaze:i\"?"),
                          HasSubstr("an output port that fits \"/Gaze:i\"; did you mean "
                                    "\"/Gaze:o\"?")));
  EXPECT_THAT(unmatched("allow user alice input /Gaze:i *z*:i /*\nallow user alice tap /Gaze:o\n"
                        "allow everyone observe\nallow everyone output,input *",
                        ports),
              IsEmpty());
  EXPECT_THAT(
      unmatched("allow user alice output /x\nallow user alice input /x", {{}, {"/Arm/pos:i"}}),
      ElementsAre(HasSubstr("an input port")))
      << "no model names an output port at all";
  EXPECT_THAT(unmatched("allow user alice output /arbiter/winner/*", ports), IsEmpty());
}

// Each of these takes some ten thousand steps to see that one name does not fit.
TEST(Policy, LooksForPortsWithinABound) {
  std::string text = "allow user alice output";
  for (int i = 0; i < 1000; ++i) {
    text += " /" + std::string(100, 'a') + "*" + std::string(100, 'a') + "b*" + std::to_string(i);
  }
  std::vector<std::string> names;
  for (int i = 0; i < 1000; ++i) names.push_back("/" + std::string(240, 'a') + std::to_string(i));
  const auto findings = unmatched(text, {{names.begin(), names.end()}, {}});
  EXPECT_GT(findings.size(), 0u);
  EXPECT_LT(findings.size(), 100u);
}

TEST(Policy, IsBounded) {
  std::string text = "allow user alice output";
  for (std::size_t i = 0; i < Policy::kMaxRules; ++i) text += " /p" + std::to_string(i);
  const Policy full = good(text);
  EXPECT_EQ(full.size(), Policy::kMaxRules);
  for (const std::string& more : {text + " /one-more", text + "\nallow everyone stop"}) {
    const Read result = read(more + "\nallow everyone stop\n");
    ASSERT_EQ(result.findings.size(), 1u);
    EXPECT_THAT(result.findings[0], HasSubstr("limit-exceeded: the policy has more rules than"));
  }
  const Read large = read(std::string(rules::kMaxFileBytes + 1, '#'));
  EXPECT_THAT(large.findings, ElementsAre(HasSubstr("limit-exceeded")));
}

// The policy that is installed says what holds without one, and the page's examples can be used.
TEST(Policy, IsAsItsFilesShowIt) {
  const std::string root = std::string(ARBITER_TEST_DATA) + "/../../";
  const Policy installed = good(rules::read_bytes(root + "systemd/policy"));
  const Policy built_in(kOwner);
  for (const Identity& who : {kRoot, kTheOwner, kOperator, kOther}) {
    for (std::size_t i = 0; i < kActionCount; ++i) {
      const auto action = static_cast<Action>(i);
      EXPECT_EQ(may(installed, who, action, "/x"), may(built_in, who, action, "/x")) << i;
    }
  }
  const Accounts everybody{[](const std::string&) { return std::optional<uid_t>(4711); },
                           [](const std::string&) { return std::optional<gid_t>(4711); }};
  std::istringstream page(rules::read_bytes(root + "docs/policy.md"));
  std::string example;
  int examples = 0;
  bool inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line == "```") {
      const bool is_policy = example.starts_with("allow ") || example.starts_with("# allow|deny");
      if (inside && is_policy) {
        rules::Diagnostics diagnostics;
        Policy::parse(rules::TextFile("example", example), kOwner, everybody, diagnostics);
        EXPECT_FALSE(diagnostics.has_errors()) << example << diagnostics.items()[0].message;
        ++examples;
      }
      inside = !inside;
      example.clear();
    } else if (inside) {
      example += line + '\n';
    }
  }
  EXPECT_EQ(examples, 5);
}

TEST(Policy, KnowsTheAccountsOfThisMachine) {
  const Accounts accounts = accounts_of_this_machine();
  EXPECT_EQ(accounts.user("root"), uid_t{0});
  EXPECT_EQ(accounts.group("root"), gid_t{0});
  EXPECT_FALSE(accounts.user("no-user-has-this-name"));
  EXPECT_FALSE(accounts.group("no-group-has-this-name"));
}

}  // namespace
}  // namespace arbiter::service
