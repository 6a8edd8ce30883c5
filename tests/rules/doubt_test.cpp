// An error in one element hides no problem of others, and brings none that only follows from it.
#include "rules/model/doubt.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "tests/rules/random_model.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::ElementsAre;
using testing::UnorderedElementsAre;

// "code" or "code port", of errors only.
std::vector<std::string> errors_in(const std::vector<std::string>& texts,
                                   const std::string& application = "") {
  rules::ModelTexts all;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    all.models.push_back({std::string(1, static_cast<char>('a' + i)) + ".xml", texts[i]});
  }
  if (!application.empty()) all.application = rules::FileText{"app.xml", application};
  rules::Diagnostics diagnostics;
  const auto set = rules::load(all, diagnostics);
  rules::compile(set, diagnostics);
  std::vector<std::string> result;
  for (const auto& item : diagnostics.items()) {
    if (item.severity != rules::Severity::kError) continue;
    const auto& ports = item.about.ports;
    result.push_back(item.code + (ports.empty() ? "" : " " + ports.front()));
  }
  return result;
}

std::vector<std::string> errors_in(const std::string& text) {
  return errors_in(std::vector<std::string>{text});
}

// What compiling says beside errors: code, port, source and behaviour of each.
std::set<std::string> warnings_in(const std::string& text) {
  rules::Diagnostics reading, compiling;
  rules::ModelTexts texts;
  texts.models.push_back({"a.xml", text});
  const auto set = rules::load(texts, reading);
  rules::compile(set, compiling);
  std::set<std::string> result;
  for (const auto& item : compiling.items()) {
    if (item.severity == rules::Severity::kError) continue;
    const auto& about = item.about;
    result.insert(item.code + ' ' + (about.ports.empty() ? "" : about.ports.front()) + ' ' +
                  about.source + ' ' + about.behaviour);
  }
  return result;
}

// The same of behaviours: /a and /b, which nothing keeps apart but what is in "A".
std::string behaviours_at(const std::string& port, const std::string& in_a) {
  return "<behavior name='A'" + in_a + "><config at='" + port + "'>/a</config></behavior>" +
         "<behavior name='B'><config at='" + port + "'>/b</config></behavior>";
}

// Two connections that can both win.
std::string conflict_at(const std::string& port) {
  return "<arbiter at='" + port + "'><select from='/a'/><select from='/b'/></arbiter>";
}

TEST(Doubt, ATimeoutThatCannotBeReadHidesNoConflict) {
  EXPECT_THAT(errors_in("<source port='/a' timeout='5 parsecs'/>" + conflict_at("/p")),
              ElementsAre("invalid-timeout", "both-can-win /p"));
  EXPECT_THAT(errors_in("<behaviors timeout='0s'>" + conflict_at("/p") + "</behaviors>"),
              ElementsAre("invalid-timeout", "both-can-win /p"));
}

TEST(Doubt, WhatWasWrittenAsAnAttributeIsMissedAsAnElementWouldBe) {
  for (const char* attribute : {" inhibits='B'", " inhibition='B'"}) {
    EXPECT_THAT(errors_in(behaviours_at("/p", attribute) + conflict_at("/q")),
                ElementsAre("unknown-attribute", "both-can-win /q"));
  }
  EXPECT_THAT(errors_in(behaviours_at("/p", " condition='not /b'") + conflict_at("/q")),
              ElementsAre("unknown-attribute", "both-can-win /q"));
  EXPECT_THAT(errors_in(behaviours_at("/p", " timeout='1s'")),
              ElementsAre("unknown-attribute", "both-can-win /p"));
}

TEST(Doubt, AConditionThatCannotBeReadHidesConflictsAtItsOwnPortsOnly) {
  const std::string at_p =
      "<behavior name='A'><config at='/p'>/a</config><condition>/b and</condition></behavior>"
      "<behavior name='B'><config at='/p'>/b</config></behavior>";
  EXPECT_THAT(errors_in(at_p + conflict_at("/q")),
              ElementsAre("malformed-condition", "both-can-win /q"));
  EXPECT_THAT(errors_in("<arbiter at='/p'><select from='/a'>/x =</select><select from='/b'/>"
                        "<select from='/c'/></arbiter>" +
                        conflict_at("/q")),
              ElementsAre("malformed-condition", "both-can-win /q"));
}

TEST(Doubt, AMetaBehavioursConditionIsThatOfAllBelowIt) {
  EXPECT_THAT(errors_in("<meta_behavior name='M'><behavior>A</behavior>"
                        "<condition>(</condition></meta_behavior>"
                        "<behavior name='A'><config at='/p'>/a</config></behavior>"
                        "<arbiter at='/p'><select from='/b'/></arbiter>" +
                        conflict_at("/q")),
              ElementsAre("malformed-condition", "both-can-win /q"));
}

TEST(Doubt, AnInhibitionOfAnUnknownNameMayBeOfAnySibling) {
  const std::string siblings =
      "<behavior name='A'><config at='/p'>/a</config><inhibition>Nobody</inhibition></behavior>"
      "<behavior name='B'><config at='/p'>/b</config></behavior>";
  const std::string family =
      "<meta_behavior name='M'><behavior>C</behavior><behavior>D</behavior></meta_behavior>"
      "<behavior name='C'><config at='/q'>/c</config></behavior>"
      "<behavior name='D'><config at='/q'>/d</config></behavior>";
  EXPECT_THAT(errors_in(siblings + conflict_at("/r")),
              ElementsAre("unknown-name", "both-can-win /r"));
  EXPECT_THAT(errors_in(siblings + family), ElementsAre("unknown-name"))
      << "M is a sibling, and what inhibits it inhibits its children";
  EXPECT_THAT(errors_in(family +
                        "<meta_behavior name='N'><behavior>A</behavior>"
                        "<behavior>B</behavior></meta_behavior>" +
                        siblings),
              ElementsAre("unknown-name", "both-can-win /q"))
      << "those in M are no siblings of those in N";
}

TEST(Doubt, QuantifiersAreInDoubtWhereASourceIsLost) {
  EXPECT_THAT(errors_in("<source port='stop'/>"
                        "<arbiter at='/p'><select from='/a'>none(/stop*)</select>"
                        "<select from='/b'>none(/stop*)</select></arbiter>" +
                        conflict_at("/q")),
              ElementsAre("invalid-port-name", "both-can-win /q"));
}

TEST(Doubt, WhatAnArbiterSaysOfConflictsIsOfItsPort) {
  EXPECT_THAT(errors_in("<arbiter at='/p' conflict='frist'><select from='/a'/>"
                        "<select from='/b'/></arbiter>" +
                        conflict_at("/q")),
              ElementsAre("invalid-conflict", "both-can-win /q"));
  EXPECT_THAT(errors_in("<arbiter at='/p' conflct='first'><select from='/a'/>"
                        "<select from='/b'/></arbiter>" +
                        conflict_at("/q")),
              ElementsAre("unknown-attribute", "both-can-win /q"));
  EXPECT_THAT(errors_in("<arbiter conflict='first'/>" + conflict_at("/q")),
              ElementsAre("missing-attribute"));
}

TEST(Doubt, AConnectionThatTheApplicationLacksLeavesOtherPortsAlone) {
  EXPECT_THAT(errors_in({conflict_at("/p") + conflict_at("/q")},
                        "<application><connection><from>/a</from><to>/p</to></connection>"
                        "<connection><from>/a</from><to>/q</to></connection>"
                        "<connection><from>/b</from><to>/q</to></connection></application>"),
              ElementsAre("not-in-application /p", "both-can-win /q"));
}

TEST(Doubt, AFileThatCannotBeReadMaySayAnything) {
  EXPECT_THAT(errors_in({conflict_at("/p"), "<behaviors>"}), ElementsAre("malformed-xml"));
}

TEST(Doubt, WhatIsRefusedIsNotMissedByItsName) {
  const std::string inhibits_a =
      "<behavior name='B'><config at='/p'>/b</config><inhibition>A</inhibition></behavior>";
  for (const std::string refused :
       {"<behavor name='A'><config at='/p'>/a</config></behavor>",
        "<group name='G'><behavior name='A'><config at='/p'>/a</config></behavior></group>",
        "<group><behavior name='A'><config at='/p'>/a</config></behavior></group>",
        "<behavior nam='A'><config at='/p'>/a</config></behavior>"}) {
    const auto found = errors_in(refused + inhibits_a);
    EXPECT_THAT(found, testing::Each(testing::AnyOf("unknown-element", "unknown-attribute",
                                                    "missing-attribute")))
        << refused;
  }
  EXPECT_THAT(errors_in("<behavior name='A, C'><config at='/p'>/a</config></behavior>"
                        "<behavior name='B'><config at='/p'>/b</config>"
                        "<inhibition>A, C</inhibition></behavior>"),
              ElementsAre("invalid-name"));
  EXPECT_THAT(errors_in("<behavor name='A'/>" + inhibits_a + conflict_at("/q")),
              ElementsAre("unknown-element", "both-can-win /q"))
      << "rules by hand do not depend on behaviours";
}

// One place of the text: an element is broken there, in one of several ways.
std::string broken(const std::string& xml, unsigned seed) {
  static const std::vector<std::pair<std::string, std::string>> kBreaks{
      {"<condition>", "<condition>/a and and "},
      {"<inhibition>", "<inhibition>Nobody, "},
      {"<inhibition>", "<inhibition>,"},
      {"<inhibition>Element", "<inhibition>Elment"},
      {"<config at=\"/", "<config at=\""},
      {"<config at=\"/", "<config att=\"/"},
      {"\">/", "\">"},
      {"<behavior>Element", "<behavior>Elemnt"},
      {"<behavior>", "<behavior x=\"\">"},
      {"<behavior name", "<behavior nam"},
      {"<meta_behavior name", "<meta_behavior nam"},
      {"<behavior name=\"Element", "<behavior name=\"Elemen"},
      {"<config ", "<konfig "},
      {"<condition>", "<x/><condition>"},
      {"<inhibition>", "stray<inhibition>"},
      {"<behavior name=\"", "<behavior name=\"x, "}};
  std::mt19937 random(seed);
  for (int attempt = 0; attempt < 20; ++attempt) {
    const auto& [from, to] = kBreaks[random() % kBreaks.size()];
    std::vector<std::size_t> places;
    for (auto at = xml.find(from); at != std::string::npos; at = xml.find(from, at + 1)) {
      places.push_back(at);
    }
    if (places.empty()) continue;
    std::string result = xml;
    result.replace(places[random() % places.size()], from.size(), to);
    return result;
  }
  return xml;
}

// A model without conflicts has none when something in it cannot be read.
TEST(Doubt, NothingFollowsFromABrokenElementOfARandomModel) {
  int refused = 0;
  for (unsigned seed = 0; seed < 2000 && refused < 600; ++seed) {
    const std::string xml = to_xml(Generator(seed).model(), {});
    if (!errors_in(xml).empty()) continue;
    const auto warnings = warnings_in(xml);
    for (unsigned variant = 0; variant < 8; ++variant) {
      const std::string text = broken(xml, seed * 8 + variant);
      const auto found = errors_in(text);
      if (found.empty()) continue;  // it has another meaning
      ++refused;
      for (const auto& warning : warnings_in(text)) {
        ASSERT_TRUE(warnings.contains(warning)) << warning << "\n" << xml << "\n" << text;
      }
      for (const auto& error : found) {
        ASSERT_FALSE(error.starts_with("both-can-win")) << error << "\n" << xml << "\n" << text;
      }
    }
  }
  EXPECT_GE(refused, 600);
}

}  // namespace
}  // namespace arbiter::test
