#include "rules/model/extraction.hpp"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string behaviour(const std::string& name, const std::string& inside) {
  return "<behavior name='" + name + "'>" + inside + "</behavior>\n";
}
std::string meta(const std::string& name, const std::vector<std::string>& children,
                 const std::string& inside = "") {
  std::string result = "<meta_behavior name='" + name + "'>" + inside;
  for (const std::string& child : children) result += "<behavior>" + child + "</behavior>";
  return result + "</meta_behavior>\n";
}
std::string config(const std::string& source, const std::string& port) {
  return "<config at='" + port + "'>" + source + "</config>";
}
std::string inhibition(const std::string& names) {
  return "<inhibition>" + names + "</inhibition>";
}
std::string condition(const std::string& text) { return "<condition>" + text + "</condition>"; }

// The paper's section V and its figures, as the example in the repository has them.
TEST(Extraction, GivesTheRulesOfSearchAndTrack) {
  const std::string folder = std::string(ARBITER_TEST_DATA) + "/../../examples/search_and_track/";
  const Loaded loaded = load_files({{folder + "search_and_track.xml"}, folder + "application.xml"});
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/Gaze/pos:i"),
              ElementsAre("/RandomLook/pos:o: (not(/Face/pos:o) and not(/Object/pos:o))",
                          "/Face/pos:o: not(/Object/pos:o)", "/Object/pos:o: not(/collision:o)"));
  EXPECT_THAT(show_rules(loaded, "/Arm/pos:i"), ElementsAre("/Object/pos:o: not(/collision:o)",
                                                            "/RestArm/pos:o: not(/Object/pos:o)"));
  EXPECT_EQ(loaded.rules.ports.size(), 2u);
  EXPECT_EQ(loaded.rules.timeout, 500'000'000);
  EXPECT_THAT(loaded.rules.timeouts, IsEmpty());
  EXPECT_THAT(loaded.rules.sources, ElementsAre("/Face/pos:o", "/Object/pos:o", "/RandomLook/pos:o",
                                                "/RestArm/pos:o", "/collision:o"));
  ASSERT_EQ(loaded.rules.other_connections.size(), 2u);
  EXPECT_EQ(loaded.rules.other_connections[0].port, "/Face/img:i");

  std::vector<std::string> names;
  for (const BehaviourRules& rules : loaded.rules.behaviours) names.push_back(rules.name);
  EXPECT_THAT(names, ElementsAre("Look Around", "Follow Face", "Track Object", "Rest Arm"));
  EXPECT_EQ(loaded.rules.behaviours[2].rules.size(), 2u);
  EXPECT_EQ(loaded.rules.behaviours[2].rules[1].first, "/Arm/pos:i");
}

TEST(Extraction, ConditionsOfAllMetaBehavioursAboveAreInherited) {
  const Loaded loaded = load_text(meta("Top", {"Middle"}, condition("/t") + condition("/u")) +
                                  meta("Middle", {"B"}, condition("/m")) +
                                  behaviour("B", config("/s", "/p") + condition("/b or /c")));
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/p"), ElementsAre("/s: ((/b or /c) and /m and /t and /u)"));
}

TEST(Extraction, InhibitionOfAMetaBehaviourReachesAllBehavioursInIt) {
  const Loaded loaded =
      load_text(meta("M", {"N", "A"}) + meta("N", {"B"}) + behaviour("A", config("/a", "/p")) +
                behaviour("B", config("/b", "/p")) +
                behaviour("X", config("/x", "/p") + config("/x2", "/p") + inhibition("M")));
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/p"),
              ElementsAre("/a: (not(/x) and not(/x2))", "/b: (not(/x) and not(/x2))", "/x: true",
                          "/x2: true"));
}

TEST(Extraction, InhibitionByAMetaBehaviourIsByAllBehavioursInIt) {
  const Loaded loaded = load_text(behaviour("A", config("/a", "/p") + config("/a", "/q")) +
                                  meta("M", {"N", "X"}, inhibition("A")) + meta("N", {"Y"}) +
                                  behaviour("X", config("/x", "/p") + config("/x2", "/r")) +
                                  behaviour("Y", config("/y", "/p") + config("/y", "/q")));
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/p"),
              ElementsAre("/a: (not(/x) and not(/y))", "/x: true", "/y: true"));
  EXPECT_THAT(show_rules(loaded, "/q"), ElementsAre("/a: not(/y)", "/y: true"))
      << "those of the meta-behaviour that have no connection there do not count there";
}

TEST(Extraction, InhibitionAcrossPortsIsByAllSourcesAndIsNoted) {
  const Loaded loaded =
      load_text(behaviour("A", config("/a", "/p") + config("/a", "/q")) +
                behaviour("X", config("/x", "/q") + config("/z", "/r") + inhibition("A")));
  EXPECT_THAT(loaded.findings(), ElementsAre("2:86 note inhibition-across-ports"));
  EXPECT_THAT(loaded.message(), HasSubstr("\"X\" inhibits \"A\" at /p without a connection there; "
                                          "it does so while /x or /z is active"));
  EXPECT_THAT(show_rules(loaded, "/p"), ElementsAre("/a: (not(/x) and not(/z))"));
  EXPECT_THAT(show_rules(loaded, "/q"), ElementsAre("/a: not(/x)", "/x: true"));
}

TEST(Extraction, InhibitionAcrossPortsIsNotedOnceForEachPort) {
  const Loaded loaded = load_text(
      meta("M", {"A", "B"}) +
      behaviour("A", config("/a", "/p") + config("/a2", "/p") + config("/a", "/q")) +
      behaviour("B", config("/b", "/p")) + behaviour("X", config("/x", "/r") + inhibition("M")));
  EXPECT_THAT(loaded.findings(), ElementsAre("4:59 note inhibition-across-ports",
                                             "4:59 note inhibition-across-ports"));
  EXPECT_THAT(loaded.message(0), HasSubstr("\"M\" at /p"));
  EXPECT_THAT(loaded.message(1), HasSubstr("\"M\" at /q"));
}

TEST(Extraction, AnInhibitorWithoutSourcesInhibitsNothing) {
  const Loaded loaded = load_text(behaviour("A", config("/a", "/p")) +
                                  behaviour("X", inhibition("A")) + meta("M", {"X"}));
  EXPECT_THAT(loaded.findings(), ElementsAre("2:17 warning no-config", "2:32 error not-a-sibling"));
  EXPECT_THAT(
      show_rules(load_text(behaviour("A", config("/a", "/p")) + behaviour("X", inhibition("A"))),
                 "/p"),
      ElementsAre("/a: true"));
}

TEST(Extraction, ARuleMayBeInhibitedByItsOwnSource) {
  const Loaded loaded = load_text(behaviour("A", config("/s", "/p")) +
                                  behaviour("B", config("/s", "/p") + inhibition("A")));
  EXPECT_FALSE(loaded.has_errors);
  EXPECT_THAT(show_rules(loaded, "/p"), ElementsAre("/s: (not(/s) or true)"));
}

TEST(Extraction, SeveralBehavioursWithOneConnectionMakeADisjunction) {
  const Loaded loaded = load_text(
      behaviour("A", config("/s", "/p") + condition("/a")) + behaviour("B", config("/t", "/p")) +
      behaviour("C", config("/s", "/p") + condition("/c") + inhibition("B")));
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/p"), ElementsAre("/s: (/a or /c)", "/t: not(/s)"));
  const ConnectionRule& rule = loaded.port("/p")->rules[0];
  EXPECT_EQ(rule.behaviour, "A");
  EXPECT_EQ(rule.where.line, 1u);
  EXPECT_EQ(show(loaded.rules.behaviours.at(2).rules.at(0).second.condition), "/c")
      << "what one behaviour asks for stays apart";
}

TEST(Extraction, ATermStandsInARuleOnce) {
  const Loaded loaded = load_text(meta("M", {"A", "X"}) + behaviour("A", config("/a", "/p")) +
                                  behaviour("X", config("/x", "/p") + inhibition("A, A")) +
                                  behaviour("Y", config("/x", "/p") + inhibition("M")));
  EXPECT_FALSE(loaded.has_errors);
  EXPECT_THAT(show_rules(loaded, "/p").at(0), "/a: not(/x)");
}

TEST(Extraction, RulesStandInDocumentOrder) {
  const Loaded loaded = load_texts(
      {"<arbiter at='/p'><select from='/d'/></arbiter>" + behaviour("Z", config("/c", "/p")),
       behaviour("A", config("/b", "/p") + config("/a", "/q") + config("/a", "/p")) +
           behaviour("B", config("/c", "/p")) + "<arbiter at='/p'><select from='/0'/></arbiter>"});
  EXPECT_FALSE(loaded.has_errors);
  EXPECT_THAT(show_rules(loaded, "/p"),
              ElementsAre("/d: true", "/c: (true or true)", "/b: true", "/a: true", "/0: true"));
  std::vector<std::string> ports;
  for (const PortRules& port : loaded.rules.ports) ports.push_back(port.port);
  EXPECT_THAT(ports, ElementsAre("/p", "/q"));
}

TEST(Extraction, AConnectionGetsItsRuleFromOnePlace) {
  const Loaded both = load_text("<arbiter at='/p'>\n<select from='/s'/></arbiter>\n" +
                                behaviour("B", config("/s", "/p")));
  EXPECT_THAT(both.findings(), ElementsAre("2:1 error rule-from-both"));
  EXPECT_THAT(both.message(), HasSubstr("from /s to /p has a rule from the behaviour \"B\""));

  const Loaded twice = load_text(
      "<arbiter at='/p'><select from='/s'/>\n<select from='/s'/>\n"
      "</arbiter><arbiter at='/p'><select from='/s'/></arbiter>");
  EXPECT_THAT(twice.findings(),
              ElementsAre("2:1 error duplicate-select", "3:28 error duplicate-select"));
  EXPECT_THAT(twice.message(), HasSubstr("from /s to /p has a rule already, at "));

  const Loaded config_twice =
      load_text(behaviour("B", config("/s", "/p") + "\n" + config("/s", "/p")));
  EXPECT_THAT(config_twice.findings(), ElementsAre("2:1 warning duplicate-config"));
  EXPECT_THAT(config_twice.message(), HasSubstr("\"B\" configures the connection from /s to /p"));
  EXPECT_THAT(show_rules(config_twice, "/p"), ElementsAre("/s: true"));
}

TEST(Extraction, AnArbiterWithoutAnyRuleIsWarnedOf) {
  for (const std::string arbiter : {"<arbiter at='/p' conflict='first'/>", "<arbiter at='/p'/>"}) {
    const Loaded loaded = load_text(arbiter);
    EXPECT_THAT(loaded.findings(), ElementsAre("1:1 warning no-rule-at-port"));
    EXPECT_THAT(loaded.message(), HasSubstr("no rule selects a connection at /p"));
    EXPECT_THAT(load_text(arbiter + behaviour("B", config("/s", "/p"))).findings(), IsEmpty());
  }
}

TEST(Extraction, OfTenThousandBehavioursIsQuick) {
  // Forty to a port, each inhibits the next three; ten to a connection.
  std::string model = "<behaviors>";
  for (int i = 0; i < 10'000; ++i) {
    std::string names;
    for (int next = i + 1; next <= i + 3 && next < 10'000; ++next) {
      names += (names.empty() ? "B" : ", B") + std::to_string(next);
    }
    model += behaviour("B" + std::to_string(i),
                       config("/s" + std::to_string(i % 40), "/p" + std::to_string(i / 400)) +
                           condition("not /stop and any(/s*)") + inhibition(names));
  }
  const Folder folder;
  const std::string path = folder.write("a.xml", model + "</behaviors>");
  const Stopwatch stopwatch;
  const Loaded loaded = load_files({{path}, {}});
  const double spent = stopwatch.seconds();
  EXPECT_FALSE(loaded.has_errors) << loaded.message();
  EXPECT_EQ(loaded.rules.behaviours.size(), 10'000u);
  EXPECT_LT(spent, 10.0) << "0.2 s where this was written, without sanitizers";
}

TEST(Extraction, OfAModelThatWouldExplodeEndsAtALimit) {
  std::vector<std::string> inside;
  std::string model;
  std::string inhibitors;
  for (int i = 0; i < 6'000; ++i) {
    const std::string name = "A" + std::to_string(i);
    inside.push_back(name);
    model += behaviour(name, config("/a", "/p"));
    inhibitors += behaviour("X" + std::to_string(i), config("/x", "/p") + inhibition("M"));
  }
  const Stopwatch stopwatch;
  const Loaded loaded = load_text(meta("M", inside) + model + inhibitors);
  EXPECT_LT(stopwatch.seconds(), 10.0);
  ASSERT_EQ(loaded.items.size(), 1u);
  EXPECT_EQ(loaded.items[0].code, "limit-exceeded");
  EXPECT_THAT(loaded.message(), HasSubstr("more terms than the limit of 16777216"));
}

// A small file of shared conditions would otherwise be gone through for hours.
TEST(Extraction, AConditionCountsInEachRuleThatItIsPartOf) {
  std::string wide = "/a";
  for (int i = 0; i < 1'000; ++i) wide += " | not /a" + std::to_string(i % 100);
  std::string model = "<define name='wide'>" + wide + "</define>";
  std::vector<std::string> inside;
  for (int i = 0; i < 100; ++i) {
    const std::string number = std::to_string(i);
    inside.push_back("B" + number);
    model += behaviour(inside.back(), config("/s" + number, "/p" + number));
  }
  for (int i = 0; i < 100; ++i) {
    model += meta("M" + std::to_string(i), inside, condition("${wide} | /x" + std::to_string(i)));
    inside = {"M" + std::to_string(i)};
  }
  const Loaded loaded = load_text(model);
  ASSERT_EQ(loaded.items.size(), 1u);
  EXPECT_EQ(loaded.items[0].code, "limit-exceeded");
  EXPECT_THAT(loaded.message(), HasSubstr("more terms than the limit of 16777216"));
  for (const PortRules& port : loaded.rules.ports) EXPECT_TRUE(port.is_doubtful) << port.port;
}

TEST(Extraction, WhatAQuantifierStandsForCountsToo) {
  std::string all, selects;
  for (int i = 0; i < 250; ++i) all += "<source port='/s" + std::to_string(i) + "'/>";
  const std::string many = [] {
    std::string text = "any(/s*)";
    for (int i = 0; i < 3'000; ++i) text += "|any(/s*)";
    return text;
  }();
  for (int i = 0; i < 30; ++i) {
    selects += "<arbiter at='/p" + std::to_string(i) + "'><select from='/s0'>" + many +
               "</select></arbiter>";
  }
  const Loaded loaded = load_text(all + selects);
  ASSERT_EQ(loaded.items.size(), 1u);
  EXPECT_EQ(loaded.items[0].code, "limit-exceeded");
}

// To look for the sources of each pattern would take long, and the model is refused in any case.
TEST(Extraction, WithTooManySourcesNoQuantifierIsLookedAt) {
  std::string model;
  for (int i = 0; i < 9'000; ++i) model += "<source port='/s" + std::to_string(i) + "'/>";
  model += behaviour("A", config("/s0", "/p") + condition("any(/nothing/*)"));
  const Loaded loaded = load_text(model);
  ASSERT_EQ(loaded.items.size(), 1u);
  EXPECT_THAT(loaded.message(), HasSubstr("9000 sources, more than the limit of 8192"));
}

}  // namespace
}  // namespace arbiter::rules
