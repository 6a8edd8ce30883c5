// What `check --hosts` says of a model whose ports are on several hosts.
#include "rules/ask/across_hosts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "rules/ask/host_places.hpp"
#include "rules/model/application_reader.hpp"
#include "rules/model/hosts.hpp"
#include "rules/prove/winners.hpp"
#include "rules/text/names.hpp"
#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::UnorderedElementsAre;

std::string module(const std::string& name, const std::string& node) {
  return "<module><name>" + name + "</name><node>" + node + "</node></module>";
}

Application application_of(const std::string& modules) {
  const TextFile file("app.xml", "<application>" + modules + "</application>");
  Diagnostics diagnostics;
  Application application = read_application(file, diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
  return application;
}

struct Checked {
  std::vector<Diagnostic> items;
  std::map<std::string, HostPlaces::Count> counts;

  // "warning negated-across-hosts /s", each: with its source, behaviour, or else its ports.
  [[nodiscard]] std::vector<std::string> findings() const {
    static constexpr const char* kSeverities[] = {"error", "warning", "note"};
    std::vector<std::string> result;
    for (const Diagnostic& item : items) {
      std::string about = item.about.source + item.about.behaviour;
      if (about.empty()) about = comma_list(item.about.ports);
      result.push_back(kSeverities[static_cast<int>(item.severity)] + (" " + item.code) +
                       (about.empty() ? "" : " " + about));
    }
    return result;
  }
  [[nodiscard]] const Diagnostic* find(const std::string& code) const {
    for (const Diagnostic& item : items) {
      if (item.code == code) return &item;
    }
    return nullptr;
  }
  [[nodiscard]] std::string message(const std::string& code) const {
    const Diagnostic* const item = find(code);
    return item == nullptr ? "" : item->message;
  }
};

Checked check(const std::string& model, const std::string& modules,
              const std::string& connections = "", std::uint64_t steps = Budget::kSteps) {
  const Loaded loaded =
      connections.empty()
          ? load_text(model)
          : load_with_application(model, "<application>" + connections + "</application>");
  EXPECT_FALSE(loaded.has_errors) << loaded.message();
  Diagnostics compiling, found;
  const CompiledModel compiled = compile(loaded.rules, compiling);
  EXPECT_FALSE(compiling.has_errors());
  const Application application = application_of(modules);
  const SourceUses uses = uses_of_sources(loaded.rules);
  const HostPlaces places(loaded.rules, uses, application, "app.xml", found);
  Budget budget(steps);
  find_across_hosts(loaded.rules, compiled, uses, places, {}, found, budget);
  return {found.items(), places.counts()};
}

const std::string kArm = R"(<behaviors>
  <behavior name="Rest"><config at="/Arm:i">/Rest:o</config></behavior>
  <behavior name="Reach"><config at="/Arm:i">/Eye:o</config><inhibition>Rest</inhibition></behavior>
</behaviors>)";

TEST(Hosts, APortBelongsToTheModuleWithTheLongestNameItBeginsWith) {
  const Application application = application_of(
      module("icub", "a") + module("/icub/head/", "b") + module("Arm", "c") +
      "<module><name>yarpdev</name><parameters> --from x.ini  --name \"/Eye\" </parameters>"
      "<node> /ICUB-1 </node></module>"
      "<module><name>Gaze</name><prefix>Look</prefix><node>e</node></module>");
  const Hosts hosts(application);
  const auto host_of = [&](const std::string& port) {
    const auto& modules = hosts.modules_of(port);
    return modules.empty() ? "" : modules.front()->node;
  };
  EXPECT_EQ(host_of("/icub/arm/state:o"), "a");
  EXPECT_EQ(host_of("/icub:o"), "a");
  EXPECT_EQ(host_of("/icub"), "a");
  EXPECT_EQ(host_of("/icub/head/state:o"), "b");
  EXPECT_EQ(host_of("/icub/headset:o"), "a");
  EXPECT_EQ(host_of("/icubs:o"), "");
  EXPECT_EQ(host_of("/Eye/img:o"), "icub-1");
  EXPECT_EQ(host_of("/yarpdev:o"), "") << "its ports are called otherwise";
  EXPECT_EQ(host_of("/Look:o"), "e");
  EXPECT_EQ(host_of("/Gaze:o"), "");
  EXPECT_EQ(host_of("/"), "");
  EXPECT_EQ(host_of(""), "");
}

TEST(AcrossHosts, OnOneHostNothingIsSaid) {
  const auto checked =
      check(kArm, module("Arm", "base") + module("Rest", "/base") + module("Eye", "BASE"));
  EXPECT_THAT(checked.findings(), IsEmpty());
  ASSERT_EQ(checked.counts.size(), 1u);
  EXPECT_EQ(checked.counts.at("base").ports, 1u);
  EXPECT_EQ(checked.counts.at("base").sources, 2u);
}

TEST(AcrossHosts, WhatBelongsToNoModuleIsNamedWithItsPlace) {
  const auto checked = check(kArm, module("Arms", "base") + module("Rest", "base"));
  EXPECT_THAT(checked.findings(), ElementsAre("error no-host /Arm:i", "error no-host /Eye:o"));
  EXPECT_EQ(checked.items[0].where.line, 2u);
  EXPECT_THAT(checked.items[0].message, HasSubstr("did you mean \"/Arms:i\"?"));
  EXPECT_EQ(checked.items[1].where.line, 3u);
  EXPECT_THAT(checked.items[1].message, HasSubstr("add the module whose --name"));
}

TEST(AcrossHosts, AModuleMustSayWhereItRunsIfAPortOfTheModelIsIts) {
  const auto checked =
      check(kArm, "<module><name>Arm</name></module>" + module("Rest", "a b") +
                      module("Eye", "base") + "<module><name>Viewer</name></module>");
  EXPECT_THAT(checked.findings(), ElementsAre("error no-node /Arm:i", "error bad-node /Rest:o"));
  EXPECT_EQ(checked.items[0].where.file, "app.xml");
  EXPECT_THAT(check(kArm, "").findings(), ElementsAre("error no-modules"));
}

TEST(AcrossHosts, ANodeIsANameThatALinkTakes) {
  const auto others = module("Rest", "base") + module("Eye", "base");
  const auto checked = check(kArm, module("Arm", "head:1") + others);
  ASSERT_THAT(checked.findings(), ElementsAre("error bad-node /Arm:i"));
  EXPECT_THAT(checked.items[0].message,
              HasSubstr("\"head:1\" is no name of a host, and no link takes it; write at most 64 "
                        "letters, digits, '.', '-' and '_', as behind the --host of its link"));
  const std::string longest(64, 'a');
  const std::string on_longest = module("Rest", longest) + module("Eye", longest);
  EXPECT_THAT(check(kArm, module("Arm", longest) + on_longest).findings(), IsEmpty());
  EXPECT_THAT(check(kArm, module("Arm", longest + 'a') + on_longest).findings(),
              ElementsAre("error bad-node /Arm:i"));
}

TEST(AcrossHosts, OnTwoHostsAnInputPortIsAnErrorAndASourceAWarning) {
  const auto checked =
      check(kArm, module("Arm", "base") + module("Arm", "spare") + module("Rest", "base") +
                      module("Rest", "head") + module("Eye", "base") + module("Eye", "base"));
  EXPECT_THAT(checked.findings(),
              ElementsAre("error port-on-two-hosts /Arm:i", "warning source-on-two-hosts /Rest:o"));
  EXPECT_THAT(checked.items[0].message, HasSubstr("base and spare, by the modules \"Arm\" (app."));
  // There it is to be changed; where the model has it, the message says.
  const std::string before = "<application>" + module("Arm", "base");
  EXPECT_EQ(describe(checked.items[0].where), "app.xml:1:" + std::to_string(before.size() + 1));
  EXPECT_THAT(checked.items[0].message, HasSubstr("a.xml:2:25) is on 2 hosts, base"));
  EXPECT_EQ(checked.items[1].where.file, "app.xml");
  EXPECT_THAT(checked.items[1].message, HasSubstr("a.xml:2:25) is on 2 hosts, base"));
}

// Each of two hosts that have a source obeys its own: for them nothing crosses.
TEST(AcrossHosts, ASourceOnTwoHostsIsAtHomeOnBoth) {
  const auto both = module("Rest", "base") + module("Rest", "head") + module("Eye", "base");
  EXPECT_EQ(check(kArm, module("Arm", "base") + both).find("crosses-network"), nullptr);
  EXPECT_THAT(
      check(kArm, module("Arm", "third") + both).message("crosses-network"),
      HasSubstr("/Eye:o crosses the network from base: it is connected to /Arm:i on third"));
}

TEST(AcrossHosts, ARemoteSourceCrossesAndACutFreesWhatItInhibits) {
  const auto checked =
      check(kArm, module("Arm", "base") + module("Rest", "base") + module("Eye", "head"));
  EXPECT_THAT(checked.findings(),
              ElementsAre("note crosses-network /Eye:o", "warning negated-across-hosts /Eye:o"));
  EXPECT_THAT(checked.message("negated-across-hosts"),
              HasSubstr("after 500ms, /Rest:o at /Arm:i may win although /Eye:o is active"));
}

TEST(AcrossHosts, WhatIsNegatedTwiceIsRequired) {
  const auto checked = check(R"(<behavior name="Drive"><config at="/Base:i">/Nav:o</config>
      <condition>not (not /Free:o) and (/Man:o -> /Free:o and /Nav2:o)</condition></behavior>)",
                             module("Base", "a") + module("Nav", "a") + module("Nav2", "a") +
                                 module("Free", "b") + module("Man", "b"));
  EXPECT_THAT(checked.findings(),
              ElementsAre("note crosses-network /Free:o", "note crosses-network /Man:o",
                          "warning negated-across-hosts /Man:o"));
  EXPECT_THAT(checked.message("crosses-network"), HasSubstr("it is read at /Base:i on a"));
}

// Where the source has its own connection, nothing is negated.
TEST(AcrossHosts, ANegationIsToldWhereItIsWritten) {
  const auto place_in = [](const std::string& model) {
    const auto checked =
        check(model, module("Arm", "a") + module("Rest", "a") + module("Eye", "b"));
    const Diagnostic* const found = checked.find("negated-across-hosts");
    return found == nullptr
               ? ""
               : std::to_string(found->where.line) + ":" + std::to_string(found->where.column);
  };
  const std::string rest = "<behavior name='Rest'><config at='/Arm:i'>/Rest:o</config>";
  EXPECT_EQ(place_in(kArm), "3:73") << "the name in the inhibition";
  // A connection of its own, at another port, stands before.
  const std::string gaze =
      "\n<behavior name='Home'>"
      "<config at='/Arm/home:i'>/Eye:o</config></behavior>\n";
  EXPECT_EQ(place_in("<behaviors>" + gaze + rest +
                     "\n  <condition>not /Eye:o</condition></behavior></behaviors>"),
            "4:3");
  EXPECT_EQ(place_in("<behaviors><define name='free'>not /Eye:o</define>" + gaze + rest +
                     "\n<condition>true</condition>\n<condition>${free}</condition></behavior>"
                     "</behaviors>"),
            "5:1")
      << "of two conditions, the one that has it";
  EXPECT_EQ(place_in("<behaviors>" + gaze + rest +
                     "\n<condition>/Eye:o or not /Eye:o</condition>\n"
                     "<condition>not /Eye:o</condition></behavior></behaviors>"),
            "5:1")
      << "and not one that names it in vain";
  EXPECT_EQ(
      place_in("<behaviors>" + gaze + "<meta_behavior name='All'><behavior>Rest</behavior>\n" +
               "<condition>none(/Eye*)</condition></meta_behavior>\n" + rest +
               "</behavior></behaviors>"),
      "4:1")
      << "a quantifier, above the behaviour";
  EXPECT_EQ(place_in("<behaviors><arbiter at='/Arm:i' conflict='first'>\n<select from='/Eye:o'/>\n"
                     "<select from='/Rest:o'/></arbiter></behaviors>"),
            "2:1")
      << "the rule that is tried before";
}

TEST(AcrossHosts, AtAPortInOrderEachConnectionIsNegatedForThoseBehindIt) {
  const auto checked =
      check(R"(<arbiter at="/Base:i" conflict="first">
      <select from="/Stop:o"/><select from="/Nav:o"/><select from="/Last:o"/></arbiter>)",
            module("Base", "a") + module("Nav", "a") + module("Stop", "b") + module("Last", "b"));
  EXPECT_THAT(checked.findings(),
              ElementsAre("note crosses-network /Last:o", "note crosses-network /Stop:o",
                          "warning negated-across-hosts /Stop:o"));
  EXPECT_THAT(checked.message("negated-across-hosts"), HasSubstr("/Nav:o at /Base:i and /Last:o"));
}

TEST(AcrossHosts, ForeverIsRefusedWhereARemoteSourceMustBeActive) {
  const std::string model = R"(<behaviors><source port="/Free:o" timeout="forever"/>
    <behavior name="Drive"><config at="/Base:i">/Nav:o</config>
      <condition>/Free:o</condition></behavior></behaviors>)";
  const std::string base = module("Base", "a") + module("Nav", "a");
  EXPECT_THAT(check(model, base + module("Free", "b")).findings(),
              Contains("error remote-forever /Free:o"));
  EXPECT_EQ(check(model, base + module("Free", "b")).find("remote-forever")->where.column, 12u)
      << "the <source>, not the <config>";
  EXPECT_THAT(check(model, base + module("Free", "a")).findings(), IsEmpty());
  const std::string commands = R"(<behaviors timeout="forever"><behavior name="Drive">
    <config at="/Base:i">/Nav:o</config></behavior></behaviors>)";
  EXPECT_THAT(check(commands, module("Base", "a") + module("Nav", "b")).findings(),
              Contains("error remote-forever /Nav:o"));
  EXPECT_EQ(check(commands, module("Base", "a") + module("Nav", "b"))
                .find("remote-forever")
                ->where.column,
            21u);
  const std::string inhibits = R"(<behaviors><source port="/Lock:o" timeout="forever"/>
    <behavior name="Drive"><config at="/Base:i">/Nav:o</config>
      <condition>not /Lock:o</condition></behavior></behaviors>)";
  const auto inhibited = check(inhibits, base + module("Lock", "b"));
  EXPECT_THAT(inhibited.findings(),
              ElementsAre("note crosses-network /Lock:o", "warning negated-across-hosts /Lock:o"));
  EXPECT_THAT(
      inhibited.message("negated-across-hosts"),
      HasSubstr("What begins or ends while the network is cut is not known there: /Nav:o at"));
}

TEST(AcrossHosts, AnEndOutsideTheModelMayBeAnywhere) {
  const std::string camera =
      "<connection><from>/Cam:o</from><to>/Eye/img:i</to></connection>"
      "<connection><from>/Rest:o</from><to>/Arm:i</to></connection>"
      "<connection><from>/Eye:o</from><to>/Arm:i</to></connection>"
      "<connection><from>/Rest:o</from><to>/Log:i</to></connection>";
  const auto checked = check(kArm,
                             module("Arm", "base") + module("Rest", "base") +
                                 module("Eye", "base") + module("Log", "head"),
                             camera);
  EXPECT_THAT(checked.findings(),
              ElementsAre("note place-unknown /Cam:o", "note crosses-network /Rest:o"));
}

TEST(AcrossHosts, LocalhostMayBeOneOfTheOthers) {
  const auto checked =
      check(kArm, module("Arm", "localhost") + module("Rest", "localhost") + module("Eye", "head"));
  EXPECT_THAT(checked.findings(), Contains("warning localhost-among-hosts"));
  EXPECT_THAT(check(kArm, module("Arm", "localhost") + module("Rest", "localhost") +
                              module("Eye", "localhost"))
                  .findings(),
              IsEmpty());
}

const std::string kSearchAndTrack = R"(<behaviors>
  <meta_behavior name="Curious"><behavior>Around</behavior><behavior>Face</behavior></meta_behavior>
  <behavior name="Around"><config at="/Gaze:i">/Random:o</config></behavior>
  <behavior name="Face"><config at="/Gaze:i">/Face:o</config><inhibition>Around</inhibition></behavior>
  <behavior name="Track"><config at="/Gaze:i">/Object:o</config><config at="/Arm:i">/Object:o</config>
    <condition>not /collision:o</condition><inhibition>Curious, Rest</inhibition></behavior>
  <behavior name="Rest"><config at="/Arm:i">/Rest:o</config></behavior>
</behaviors>)";
const std::string kHeadAndBase = module("Gaze", "head") + module("Random", "head") +
                                 module("Face", "head") + module("Object", "head") +
                                 module("Arm", "base") + module("Rest", "base") +
                                 module("collision", "base");

TEST(AcrossHosts, TheRobotOfThePaperOnTwoHosts) {
  const auto checked = check(kSearchAndTrack, kHeadAndBase);
  EXPECT_THAT(
      checked.findings(),
      ElementsAre("note crosses-network /Object:o", "warning negated-across-hosts /Object:o",
                  "note crosses-network /collision:o", "warning negated-across-hosts /collision:o",
                  "note behaviour-on-two-hosts Track", "note not-at-one-instant /Arm:i, /Gaze:i"));
}

// Each pair of connections that the check names, beside all states of the five sources.
TEST(AcrossHosts, ExclusionsAreThoseOfAllStates) {
  const auto checked = check(kSearchAndTrack, kHeadAndBase);
  std::set<std::pair<std::string, std::string>> named, excluded;
  const Diagnostic* const note = checked.find("not-at-one-instant");
  ASSERT_NE(note, nullptr);
  for (std::size_t i = 0; i + 1 < note->about.winners.size(); i += 2) {
    named.emplace(*note->about.winners[i].second, *note->about.winners[i + 1].second);
  }
  Diagnostics diagnostics;
  const Loaded loaded = load_text(kSearchAndTrack);
  const CompiledModel model = compile(loaded.rules, diagnostics);
  ASSERT_EQ(model.ports.size(), 2u);
  for (const CompiledRule& arm : model.ports[0].rules) {
    for (const CompiledRule& gaze : model.ports[1].rules) excluded.emplace(arm.source, gaze.source);
  }
  for (unsigned state = 0; state < 1u << model.sources.size(); ++state) {
    std::set<std::string> active;
    for (std::size_t i = 0; i < model.sources.size(); ++i) {
      if ((state >> i & 1u) != 0) active.insert(model.sources[i]);
    }
    const CompiledRule* const arm = find_winner(model.ports[0], active);
    const CompiledRule* const gaze = find_winner(model.ports[1], active);
    if (arm != nullptr && gaze != nullptr) excluded.erase({arm->source, gaze->source});
  }
  EXPECT_EQ(named, excluded);
  EXPECT_EQ(named.size(), 3u);
}

TEST(AcrossHosts, WhatCannotBeAffordedIsLeftOpen) {
  const auto checked = check(kSearchAndTrack, kHeadAndBase, "", 100);
  EXPECT_THAT(checked.findings(), Contains("note left-open /Arm:i, /Gaze:i"));
  EXPECT_THAT(checked.findings(), Not(Contains("note not-at-one-instant /Arm:i, /Gaze:i")));
}

// A robot of 200 ports on two hosts that all hear one stop: 10 000 pairs of ports.
TEST(AcrossHosts, ManyPortsTakeNoLongerThanTheBudgetAllows) {
  std::string model = "<behaviors>", modules = module("Stop", "h0");
  for (int i = 0; i < 202; ++i) {
    const std::string n = std::to_string(i);
    model += "<behavior name='B" + n + "'><config at='/P" + n + ":i'>/S" + n +
             ":o</config><condition>not /Stop:o</condition></behavior>";
    modules += module("P" + n, "h" + std::to_string(i % 2)) + module("S" + n, "h0");
  }
  const auto checked = check(model + "</behaviors>", modules, "", 50'000'000);
  EXPECT_THAT(checked.message("left-open"), HasSubstr("nor of any beyond 10000"));
}

TEST(AcrossHosts, AStatementAboutPortsOfTwoHostsIsOnlyTrueOfOneInstant) {
  const Loaded loaded = load_text(kSearchAndTrack);
  Diagnostics diagnostics, found;
  const CompiledModel compiled = compile(loaded.rules, diagnostics);
  const TextFile file("s.txt",
                      "winner(/Arm:i) = /Rest:o -> winner(/Gaze:i) != /Object:o\n"
                      "/collision:o -> winner(/Arm:i) != /Object:o\n");
  Budget budget;
  const auto verdicts = judge(read_statements(file, diagnostics), compiled, diagnostics, budget);
  ASSERT_EQ(verdicts.size(), 2u);
  const Application application = application_of(kHeadAndBase);
  const SourceUses uses = uses_of_sources(loaded.rules);
  const HostPlaces places(loaded.rules, uses, application, "app.xml", found);
  find_across_hosts(loaded.rules, compiled, uses, places, verdicts, found, budget);
  const Checked checked{found.items(), {}};
  ASSERT_NE(checked.find("statement-on-two-hosts"), nullptr);
  EXPECT_EQ(checked.find("statement-on-two-hosts")->where.line, 1u);
  EXPECT_EQ(found.count(Severity::kWarning, "statement-on-two-hosts"), 1u);
}

}  // namespace
}  // namespace arbiter::rules
