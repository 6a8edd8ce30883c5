#include "rules/model/model_reader.hpp"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::HasSubstr;
using testing::IsEmpty;

const std::vector<std::string> kGazeRules{"/RandomLook/pos:o: not(/Face/pos:o)",
                                          "/Face/pos:o: true"};

TEST(ModelReader, TakesListing1OfThePaperAsItStands) {
  const Loaded loaded = load_text(std::string(kListing1));
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/Gaze/pos:i"), ElementsAreArray(kGazeRules));
  EXPECT_EQ(loaded.rules.timeout, shm::kDefaultTimeout);
}

TEST(ModelReader, TakesListing1WithARootInEverySpellingAndDress) {
  const std::string listing(kListing1);
  std::string british = listing;
  for (std::size_t at = 0; (at = british.find("behavior", at)) != std::string::npos; at += 9) {
    british.replace(at, 8, "behaviour");
  }
  std::string in_crlf;
  for (const char byte : listing) in_crlf += byte == '\n' ? "\r\n" : std::string(1, byte);
  for (const std::string& model : {
           "<behaviors>" + listing + "</behaviors>",
           "<behaviours>" + british + "</behaviours>",
           british,
           "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- c --><behaviors timeout='500ms'>" +
               listing + "</behaviors><!-- c -->\n",
           "\xef\xbb\xbf" + listing,
           "<!-- c -->" + in_crlf,
       }) {
    const Loaded loaded = load_text(model);
    EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
    EXPECT_THAT(show_rules(loaded, "/Gaze/pos:i"), ElementsAreArray(kGazeRules));
  }
}

TEST(ModelReader, AModelMayBeWithoutRulesButAFileNotEmpty) {
  for (const std::string model : {"<behaviors/>", "<behaviours></behaviours>",
                                  "<!-- c --><behaviors>\n<!-- c -->\n</behaviors>\n"}) {
    const Loaded loaded = load_text(model);
    EXPECT_THAT(loaded.findings(), IsEmpty());
    EXPECT_THAT(loaded.rules.ports, IsEmpty());
  }
  for (const std::string model :
       {"", " ", "\n\n", "<!-- c -->", "\xef\xbb\xbf", "\n<?xml version='1.0'?>\n"}) {
    const Loaded loaded = load_text(model);
    EXPECT_THAT(loaded.findings(), ElementsAre("1:1 error empty-file")) << model;
    EXPECT_THAT(loaded.message(), HasSubstr("a model without rules is <behaviors/>"));
  }
}

TEST(ModelReader, NamesAreTrimmedAndInnerWhiteSpaceCountsAsOneBlank) {
  const Loaded loaded = load_text(R"(
    <meta_behavior name=" Be
      Curious"><behavior>
        Look   Around</behavior><meta_behavior><![CDATA[ Follow	Face ]]></meta_behavior>
    </meta_behavior>
    <behavior name="Look Around"><config at=" /p "> /a
    </config></behavior>
    <behavior name="Follow &#32; Face"><config at="/p"><!-- c --> /b </config>
      <inhibition> Look
          Around , </inhibition></behavior>)");
  EXPECT_THAT(loaded.findings(), ElementsAre("10:18 error empty-name"));
  EXPECT_THAT(show_rules(loaded, "/p"), ElementsAre("/a: not(/b)", "/b: true"));
  EXPECT_EQ(loaded.rules.behaviours.at(0).name, "Look Around");
}

TEST(ModelReader, SeveralConditionsAreConjoinedAndEmptyOnesAreNone) {
  const Loaded loaded = load_text(R"(<behavior name="B">
    <config at="/p">/s</config>
    <condition>/a or /b</condition><condition/><condition> <!-- none --> </condition>
    <condition>not /c</condition></behavior>)");
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/p"), ElementsAre("/s: ((/a or /b) and not(/c))"));
}

TEST(ModelReader, AnInhibitionIsRepeatableAndTakesSeveralNames) {
  const Loaded loaded = load_text(R"(
    <behavior name="A"><config at="/p">/a</config></behavior>
    <behavior name="B"><config at="/p">/b</config></behavior>
    <behavior name="C"><config at="/p">/c</config></behavior>
    <behavior name="D"><config at="/p">/d</config>
      <inhibition>A,B</inhibition><inhibition> </inhibition><inhibition>C, A</inhibition>
    </behavior>)");
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/p"),
              ElementsAre("/a: not(/d)", "/b: not(/d)", "/c: not(/d)", "/d: true"));
}

TEST(ModelReader, TimeoutsAreOfTheModelAndOfSources) {
  const Loaded loaded = load_text(R"(<behaviors timeout=" 250us ">
    <source port="/a" timeout="forever"/><source port=" /b " timeout="10ns"/><source port="/c"/>
    <arbiter at="/p"><select from="/d">/a or /b or /c</select></arbiter></behaviors>)");
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_EQ(loaded.rules.timeout, 250'000);
  EXPECT_THAT(loaded.rules.timeouts,
              ElementsAre(testing::Pair("/a", shm::kForever), testing::Pair("/b", 10)));
  EXPECT_THAT(loaded.rules.sources, ElementsAre("/a", "/b", "/c", "/d"));
}

TEST(ModelReader, RulesMayBeWrittenByHand) {
  const Loaded loaded = load_text(R"(
    <arbiter at="/Arm/pos:i" conflict="first">
      <select from="/RestArm/pos:o">/RestArm/pos:o and not /Object/pos:o</select>
      <select from="/Object/pos:o"> </select>
    </arbiter>
    <arbiter at="/Gaze/pos:i"><select from="/Face/pos:o"/></arbiter>
    <arbiter at="/Arm/pos:i"><select from="/Hand/pos:o">true</select></arbiter>)");
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/Arm/pos:i"),
              ElementsAre("/RestArm/pos:o: (/RestArm/pos:o and not(/Object/pos:o))",
                          "/Object/pos:o: true", "/Hand/pos:o: true"));
  EXPECT_TRUE(loaded.port("/Arm/pos:i")->first_wins);
  EXPECT_EQ(loaded.port("/Arm/pos:i")->where.line, 2u) << "the first <arbiter> for the port";
  EXPECT_FALSE(loaded.port("/Gaze/pos:i")->first_wins);
  EXPECT_EQ(loaded.port("/Gaze/pos:i")->rules[0].behaviour, "");
}

struct Mistake {
  std::string model, finding, message;
};

void expect_findings(const std::vector<Mistake>& mistakes) {
  for (const Mistake& mistake : mistakes) {
    const Loaded loaded = load_text(mistake.model);
    EXPECT_THAT(loaded.findings(), ElementsAre(mistake.finding)) << mistake.model;
    EXPECT_THAT(loaded.message(), HasSubstr(mistake.message)) << mistake.model;
    EXPECT_THAT(loaded.message(), HasSubstr("; ")) << "does not say what to do";
  }
}

TEST(ModelReader, UnknownElementsAndTextAreErrors) {
  expect_findings({
      {"<behaviors>\n <behavor name='B'/></behaviors>", "2:2 error unknown-element",
       "did you mean <behavior>?"},
      {"<thing/>", "1:1 error unknown-element", "it takes <behaviors>, <define>, <source>"},
      {"<behaviors><thing/></behaviors>", "1:12 error unknown-element",
       "it takes <define>, <source>, <behavior>, <meta_behavior> or <arbiter>"},
      {"<Behaviors/>", "1:1 error unknown-element", "did you mean <behaviors>?"},
      {"<application/>", "1:1 error unknown-element", "give it with --application"},
      {"<application><arbitraton/></application>", "1:1 error unknown-element",
       "did you mean that where it has <arbitraton>?"},
      {"<aplication/>", "1:1 error unknown-element", "did you mean <application>?"},
      {"<source port='/a'/><behaviors/>", "1:20 error unknown-element", "put it around everything"},
      {"<behaviors><behaviors/></behaviors>", "1:12 error unknown-element",
       "put it around everything"},
      {"<behaviors/>\n<source port='/a'/>", "2:1 error unknown-element",
       "stands behind the root; move it into <behaviors>"},
      {"<behavior name='B'><config at='/p'>/s</config><select/></behavior>",
       "1:47 error unknown-element", "it takes <config>, <condition> or <inhibition>"},
      {"<behavior name='B'><config at='/p'>/s</config><Condition/></behavior>",
       "1:47 error unknown-element", "did you mean <condition>?"},
      {"<behavior name='B'><config at='/p'>/s<b/></config></behavior>",
       "1:38 error unknown-element", "<config> takes text only, no <b>"},
      {"<meta_behavior name='M'><config at='/p'>/s</config></meta_behavior>",
       "1:25 error unknown-element", "a meta-behaviour has no <config>"},
      {"<meta_behavior name='M'><arbiter/></meta_behavior>", "1:25 error unknown-element",
       "it takes <behavior>, <condition> or <inhibition>"},
      {"<behaviors><include file='arm.xml'/></behaviors>", "1:12 error unknown-element",
       "no file includes another; give all files of a model together, as in `arbiter check "},
      {"<xi:include href='arm.xml'/>", "1:1 error unknown-element", "no file includes another"},
      {"<behavior name='B'><config at='/p'>/s</config><conection at='/q'>/s</conection></behavior>",
       "1:47 error unknown-element", "write a connection as <config at="},
      {"<behavior name='B'><config at='/p'>/s</config><inhibit>C</inhibit></behavior>",
       "1:47 error unknown-element", "did you mean <inhibition>?"},
      {"<behavior name='B'><config at='/p'>/s</config><include file='c.xml'/></behavior>",
       "1:47 error unknown-element", "no file includes another"},
      {"<behavior name='B'><config at='/p'>/s</config><inhibits>C</inhibits></behavior>",
       "1:47 error unknown-element", "did you mean <inhibition>?"},
      {"<behavior name='B'><config at='/p'>/s</config><inhibited_by>C</inhibited_by></behavior>",
       "1:47 error unknown-element", "an <inhibition> stands in the behaviour that inhibits"},
      {"<behavior name='B'><config at='/p'>/s</config><timeout>1s</timeout></behavior>",
       "1:47 error unknown-element", "a source has one: write <source port="},
      {"<behavior name='B'><config at='/p'>/s</config><name>B</name></behavior>",
       "1:47 error unknown-element", "it is an attribute: <behavior name="},
      {"<arbiter at='/p'><select from='/s'/><priority>1</priority></arbiter>",
       "1:37 error unknown-element", "write <arbiter at=\"…\" conflict=\"first\">, so that"},
      {"<behavior name='B'><config at='/p'><priority>1</priority></config></behavior>",
       "1:36 error unknown-element", "in the model name those that a behaviour keeps out"},
      {"<behavior name='B'><config at='/p'><from>/s</from></config></behavior>",
       "1:36 error unknown-element", "with the input port in the attribute at, and the output"},
      {"<behaviors><connection from='/s' to='/p'/></behaviors>", "1:12 error unknown-element",
       "a behaviour has the connections that it needs, as <config at="},
      {"<source port='/a'><b/></source>", "1:19 error unknown-element", "not known here; remove"},
      {"<arbiter at='/p'><config at='/p'>/s</config></arbiter>", "1:18 error unknown-element",
       "it takes <select>"},
      {"<behaviors>\n  text\n</behaviors>", "2:3 error stray-text", "the text \"text\""},
      {"text", "1:1 error stray-text", "belongs to no element"},
      {"<behaviors/> text", "1:14 error stray-text", "belongs to no element"},
      {"<behavior name='B'>/s<config at='/p'>/s</config></behavior>", "1:20 error stray-text",
       "remove it, or put it into one"},
      {"<behavior name='B'><config at='/p'>/s</config><![CDATA[x]]></behavior>",
       "1:56 error stray-text", "\"x\""},
      {"<source port='/a'>b</source>", "1:19 error stray-text", "\"b\""},
      {"<arbiter at='/p'>/s<select from='/s'/></arbiter>", "1:18 error stray-text", "\"/s\""},
  });
}

TEST(ModelReader, UnknownMissingAndRepeatedAttributesAreErrors) {
  expect_findings({
      {"<behavior name='B' timeout='1s'><config at='/p'>/s</config></behavior>",
       "1:20 error unknown-attribute", "write <source port=\"…\" timeout=\"…\"/> beside"},
      {"<behavior name='B'><config at='/p' priority='3'>/s</config></behavior>",
       "1:36 error unknown-attribute",
       "in the model name those that a behaviour keeps out in its <inhibition>, or"},
      {"<define name='d' value='/p'/>", "1:18 error unknown-attribute",
       "write the value between the tags: <define"},
      {"<behaviors time='1s'/>", "1:12 error unknown-attribute", "did you mean timeout?"},
      {"<behavior name='B' time='1s'><config at='/p'>/s</config></behavior>",
       "1:20 error unknown-attribute", "write <source port=\"…\" timeout=\"…\"/> beside"},
      {"<source port='/a' priority='1'/>", "1:19 error unknown-attribute",
       "in its <inhibition>, or"},
      {"<arbiter at='/p'><select from='/s' priority='1'/></arbiter>",
       "1:36 error unknown-attribute", "; write <arbiter at=\"…\" conflict=\"first\">, so that"},
      {"<arbiter at='/p'><select from='/s' timeout='1s'/></arbiter>",
       "1:36 error unknown-attribute", "write <source port=\"…\" timeout=\"…\"/> beside"},
      {"<behavior name='B'><config at='/p' from='/s'>/s</config></behavior>",
       "1:36 error unknown-attribute", "the output port between the tags: <config at="},
      {"<behaviors timout='1s'/>", "1:12 error unknown-attribute", "did you mean timeout?"},
      {"<source port='/a' tiemout='1s'/>", "1:19 error unknown-attribute", "mean timeout?"},
      {"<source prt='/a'\nport='/a'/>", "1:9 error unknown-attribute", "did you mean port?"},
      {"<source port='/a' port='/b'/>", "1:19 error duplicate-attribute", "\"port\" occurs twice"},
      {"<source/>", "1:1 error missing-attribute", "lacks the attribute port; write port="},
      {"<behavior name='B' x='1'><config at='/p'>/s</config></behavior>",
       "1:20 error unknown-attribute", "it takes name"},
      {"<behavior name='B' inhibits='C'><config at='/p'>/s</config></behavior>",
       "1:20 error unknown-attribute", "write <inhibition>…</inhibition> between its tags"},
      {"<arbiter at='/p'><select from='/s' when='/a'/></arbiter>", "1:36 error unknown-attribute",
       "write the condition between the tags: <select from="},
      {"<arbiter at='/p' port='/p'><select from='/s'/></arbiter>", "1:18 error unknown-attribute",
       "did you mean at?"},
      {"<meta_behavior name='M' condition='/s'/>", "1:25 error unknown-attribute",
       "write <condition>…</condition> between its tags"},
      {"<behavior><config at='/p'>/s</config></behavior>", "1:1 error missing-attribute",
       "lacks the attribute name"},
      {"<meta_behavior/>", "1:1 error missing-attribute", "lacks the attribute name"},
      {"<behavior name='B'><config>/s</config></behavior>", "1:20 error missing-attribute",
       "lacks the attribute at"},
      {"<behavior name='B'><config at='/p'>/s</config><condition if='x'/></behavior>",
       "1:58 error unknown-attribute", "has no attribute \"if\"; remove it"},
      {"<behavior name='B'><config at='/p'>/s</config><inhibition of='x'/></behavior>",
       "1:59 error unknown-attribute", "has no attribute \"of\"; remove it"},
      {"<meta_behavior name='M'><behavior of='x'>C</behavior></meta_behavior>"
       "<behavior name='C'><config at='/p'>/s</config></behavior>",
       "1:35 error unknown-attribute", "has no attribute \"of\"; remove it"},
      {"<meta_behavior name='M'>\n<behavior name='B'/></meta_behavior>",
       "2:1 error unknown-attribute", "write <behavior>name</behavior> here"},
      {"<arbiter><select from='/s'/></arbiter>", "1:1 error missing-attribute",
       "lacks the attribute at"},
      {"<arbiter at='/p'><select>/s</select></arbiter>", "1:18 error missing-attribute",
       "lacks the attribute from"},
      {"<source port='/a<b'/>", "1:17 error malformed-xml", "write &lt;"},
      {"<source port='/a&b'/>", "1:17 error malformed-xml", "write &amp;"},
  });
}

TEST(ModelReader, NamesThatAreNoneAreErrors) {
  const std::string long_name(256, 'x');
  expect_findings({
      {"<behavior name=' '><config at='/p'>/s</config></behavior>", "1:17 error empty-name",
       "the name of this behaviour is empty"},
      {"<behavior name='B'><config at='/p'> </config></behavior>", "1:36 error empty-name",
       "the output port is empty"},
      {"<behavior name='B'><config at='/p'/></behavior>", "1:20 error empty-name",
       "the output port is empty"},
      {"<behavior name='B'><config at=''>/s</config></behavior>", "1:32 error empty-name",
       "the attribute \"at\" is empty"},
      {"<define name='p'>p</define>\n"
       "<behavior name='B'><config at='${p}'>/s</config><config at='${p}'>/t</config></behavior>",
       "2:32 error invalid-port-name", "write \"/p\" for \"p\" (in the text of ${p})"},
      {"<behavior name='B'>\n<config at=' p'>/s</config></behavior>",
       "2:14 error invalid-port-name", "write \"/p\" for \"p\""},
      {"<behavior name='B'>\n<config at='/p'>\n /s /t </config></behavior>",
       "3:4 error invalid-port-name", "\"/s /t\" are several names"},
      {"<behavior name='B'>\n<config at='/p'>s</config></behavior>", "2:17 error invalid-port-name",
       "write \"/s\" for \"s\""},
      {"<source port='/a&quot;b'/>", "1:17 error invalid-port-name", "a double quote"},
      {"<source port='&quot;/a&quot;'/>", "1:15 error invalid-port-name", "write /a without"},
      {"<source port='a'/>", "1:15 error invalid-port-name", "begins with '/'"},
      {"<arbiter at='/p'>\n<select from='s'/></arbiter>", "2:15 error invalid-port-name",
       "begins with '/'"},
      {"<source port='/" + long_name + "'/>", "1:15 error name-too-long",
       "has 257 bytes, more than the limit of 255"},
      {"<behavior name='" + long_name + "'><config at='/p'>/s</config></behavior>",
       "1:17 error name-too-long", "more than the limit of 255"},
      {"<arbiter at='/p'>\n<select from='/s'>not /" + long_name + "</select></arbiter>",
       "2:23 error name-too-long", "more than the limit of 255"},
      {"<behavior name='A, B'><config at='/p'>/s</config></behavior>", "1:17 error invalid-name",
       "has a comma"},
      {"<meta_behavior name='M'><behavior/></meta_behavior>", "1:25 error empty-name",
       "the name of this behaviour is empty"},
      {"<behavior name='B'><config at='/p'>/s</config>"
       "<inhibition>\n,C</inhibition></behavior><behavior name='C'>"
       "<config at='/p'>/s</config></behavior>",
       "2:1 error empty-name", "a name is missing beside this comma"},
  });
}

TEST(ModelReader, WrongValuesAreErrors) {
  expect_findings({
      {"<behaviors timeout='0'/>", "1:21 error invalid-timeout", "has no unit"},
      {"<behaviors timeout=''/>", "1:21 error invalid-timeout", "a whole number with a unit"},
      {"<behaviors timeout=' 0ms'/>", "1:22 error invalid-timeout", "is zero"},
      {"<source port='/a' timeout='99999999999s'/>", "1:28 error invalid-timeout",
       "the limit of 2305843009213693951ns"},
      {"<define name='t'>1.5s</define>\n<source port='/a' timeout='${t}'/>",
       "2:28 error invalid-timeout", "a fraction; write 1500ms in its place (in the text of ${t})"},
      {"<arbiter at='/p' conflict='last'><select from='/s'/></arbiter>",
       "1:28 error invalid-conflict", "write conflict=\"first\""},
      {"<arbiter at='/p' conflict=''><select from='/s'/></arbiter>", "1:28 error invalid-conflict",
       "write conflict=\"first\""},
      {"<behavior name='B'><config at='/p'>/s</config>\n<condition>/a and\n</condition></behavior>",
       "3:1 error malformed-condition", "the condition ends"},
      {"<arbiter at='/p'><select from='/s'>\n/a b</select></arbiter>",
       "2:4 error malformed-condition", "\"b\" is neither"},
      {"<source port='/a'/><source port='/b'/>\n<source port='/a'/>", "2:1 error duplicate-source",
       "the source /a is declared already, at "},
  });
}

TEST(ModelReader, BytesThatNoModelHasAreErrors) {
  expect_findings({
      {std::string("<behaviors>\n\0</behaviors>", 25), "2:1 error invalid-character", "0x00"},
      {std::string("\0<\0b", 4), "1:1 error invalid-character",
       "0x00 must not occur in this file; save"},
      {"<behaviors>\x01</behaviors>", "1:12 error invalid-character", "control character 0x01"},
      {"<behaviors>\x7f</behaviors>", "1:12 error invalid-character", "control character 0x7f"},
      {"<!-- \xc2\x85 -->", "1:6 error invalid-character", "control character 0x85"},
      {"<!-- Andr\xe9 -->", "1:10 error invalid-character", "0xe9 is not UTF-8"},
      {"\xff\xfe<\0b\0", "1:1 error invalid-character", "save the file in UTF-8"},
      {"<source port='/a&#7;'/>", "1:17 error malformed-xml", "names no character"},
  });
}

TEST(ModelReader, ReportsEverythingThatIsWrongInOneGo) {
  const Loaded loaded = load_text(R"(<behaviors timeout="1">
  <define name="p">/p</define>
  <behavior name="A" x="">
    <config at="${q}">/a</config>
    <config at="p">a</config>
    oops
    <condition>/a and</condition>
    <condition>or</condition>
    <inhibition>A, Nobody</inhibition>
  </behavior>
  <arbiter at="/p" conflict="no">
    <select from="x">y</select>
  </arbiter>
</behaviors>)");
  EXPECT_THAT(loaded.findings(),
              ElementsAre("1:21 error invalid-timeout", "3:22 error unknown-attribute",
                          "4:17 error unknown-define", "5:17 error invalid-port-name",
                          "5:20 error invalid-port-name", "6:5 error stray-text",
                          "7:22 error malformed-condition", "8:16 error malformed-condition",
                          "9:17 error self-inhibition", "9:20 error unknown-name",
                          "11:30 error invalid-conflict", "12:19 error invalid-port-name",
                          "12:22 error malformed-condition"));
}

TEST(ModelReader, WhatIsRefusedMakesItsMentionsNoFurtherMistakes) {
  // The second line defines what the others mention, and is wrong each time.
  const std::string mentions =
      "<meta_behavior name='M'><behavior>A</behavior></meta_behavior>"
      "<behavior name='B'><config at='/p'>/b</config>"
      "<inhibition>A</inhibition></behavior>\n";
  for (const std::string wrong : {
           "<behavor name='A'><config at='/p'>/a</config></behavor>",
           "<behavior nme='A'><config at='/p'>/a</config></behavior>",
           "<behavior name='${A}'><config at='/p'>/a</config></behavior>",
           "<behavior name='A'><config at='/p'>/a</config></behaviour>",
           "<behaviors><behavior name='A'><config at='/p'>/a</config></behavior></behaviors>",
       }) {
    const Loaded loaded = load_text(mentions + wrong);
    for (const Diagnostic& item : loaded.items) EXPECT_EQ(item.where.line, 2u) << item.message;
    EXPECT_TRUE(loaded.has_errors);
  }
}

}  // namespace
}  // namespace arbiter::rules
