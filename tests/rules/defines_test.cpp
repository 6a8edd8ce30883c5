#include "rules/text/defines.hpp"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST(Defines, WorkInEveryTextAndAttribute) {
  const Loaded loaded = load_text(R"(<behaviors>
    <define name="t">2s</define>
    <define name="s">/s</define>
    <define name="p">/p</define>
    <define name="b"> B </define>
    <define name="how">first</define>
    <define name="c">not ${s}/x</define>
    <source port="${s}/x" timeout="${t}"/>
    <meta_behavior name="M"><behavior>A</behavior><behavior>${b}</behavior></meta_behavior>
    <behavior name="A"><config at="${p}">${s}/a</config><inhibition>${b}</inhibition></behavior>
    <behavior name="${b}"><config at="${p}">${s}/b</config><condition>${c}</condition></behavior>
    <arbiter at="${p}" conflict="${how}"><select from="${s}/c">${c} and ${c}</select></arbiter>
  </behaviors>)");
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/p"), ElementsAre("/s/a: true", "/s/b: (not(/s/x) and not(/s/a))",
                                                    "/s/c: (not(/s/x) and not(/s/x))"));
  EXPECT_EQ(loaded.rules.timeouts.at("/s/x"), 2'000'000'000);
  EXPECT_TRUE(loaded.port("/p")->first_wins);
}

TEST(Defines, MayUseEarlierOnesAndJoinToOneName) {
  const Loaded loaded = load_text(R"(
    <define name="robot"> /left </define>
    <define name="arm">${robot}/arm</define>
    <define name="nothing"/>
    <behavior name="B"><config at="${arm}${nothing}/pos:i">${arm}:o</config></behavior>)");
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/left/arm/pos:i"), ElementsAre("/left/arm:o: true"));
}

TEST(Defines, OfAnEarlierFileAreUsableInALaterOne) {
  const std::string definition = "<define name='p'>/p</define>";
  const std::string use = "<behavior name='B'><config at='${p}'>/s</config></behavior>";
  EXPECT_THAT(load_texts({definition, use}).findings(), IsEmpty());
  EXPECT_THAT(load_texts({use, definition}).findings(true),
              ElementsAre("a.xml:1:32 error unknown-define"));
}

// What is forgotten may be what keeps a robot from moving.
TEST(Defines, ThatNothingUsesAreNoted) {
  const std::string behaviour =
      "<behavior name='B'><config at='/p'>/s</config><condition>not /x</condition></behavior>";
  const Loaded forgotten = load_text("<behaviors>\n<define name='free'>not /bumper</define>\n" +
                                     behaviour + "</behaviors>");
  EXPECT_THAT(forgotten.findings(), ElementsAre("2:15 note unused-define"));
  EXPECT_THAT(forgotten.message(), HasSubstr("nothing uses the define \"free\""));
  EXPECT_THAT(forgotten.message(), HasSubstr("; write ${free} where it is to count, or remove it"));
  // One that another one uses is used.
  EXPECT_THAT(load_text("<behaviors><define name='a'>/x</define>\n<define name='b'>${a}</define>" +
                        behaviour + "</behaviors>")
                  .findings(),
              ElementsAre("2:15 note unused-define"));
  EXPECT_THAT(load_text("<behaviors><define name='p'>/p</define><behavior name='B'>"
                        "<config at='${p}'>/s</config></behavior></behaviors>")
                  .findings(),
              IsEmpty());
  // The use may be in what was refused.
  EXPECT_THAT(load_text("<behaviors><define name='free'>not /bumper</define><behavior name='B'>"
                        "<config at='/p'>/s</config><condition>(${free}</condition></behavior>"
                        "</behaviors>")
                  .findings(),
              Not(Contains(HasSubstr("unused-define"))));
}

// Not all models need all that is offered to them.
TEST(Defines, OfAFileOfDefinesAloneNeedNotBeUsed) {
  const std::string library = "<behaviors><define name='p'>/p</define><define name='q'>/q</define>";
  const std::string use = "<behavior name='B'><config at='${p}'>/s</config></behavior>";
  EXPECT_THAT(load_texts({library + "</behaviors>", use}).findings(), IsEmpty());
  EXPECT_THAT(load_texts({use, library + "</behaviors>"}).findings(true),
              ElementsAre("a.xml:1:32 error unknown-define"));
  EXPECT_THAT(load_texts({library + "<source port='/s'/></behaviors>", use}).findings(true),
              ElementsAre("a.xml:1:54 note unused-define"));
}

TEST(Defines, ADollarWithoutABraceIsADollar) {
  const Loaded loaded =
      load_text("<behavior name='$5 }{'><config at='/$p}'>/s$</config></behavior>");
  EXPECT_THAT(loaded.findings(), IsEmpty()) << loaded.message();
  EXPECT_THAT(show_rules(loaded, "/$p}"), ElementsAre("/s$: true"));
}

TEST(Defines, MistakesAreReportedAtTheirPlace) {
  struct Case {
    std::string model, finding, message;
  };
  const std::vector<Case> cases{
      {"<define name='gaze'>/p</define>\n<define name='gaze'>/q</define>",
       "2:15 error duplicate-define", "\"gaze\" exists already, at "},
      {"<define name='gaze'>/p</define>\n<source port='${gase}'/>", "2:15 error unknown-define",
       "no define has the name \"gase\"; did you mean \"gaze\"?"},
      {"<source port='/a${b}'/>", "1:17 error unknown-define", "write <define name="},
      {"<source port='/a${}'/>", "1:17 error unknown-define", "the name \"\""},
      {"<source port='/${b}'/>\n<define name='b'>b</define>", "1:16 error unknown-define",
       "used before it is defined, at "},
      {"<define name='b'>${b}</define>", "1:18 error unknown-define",
       "${b} uses itself; write out"},
      {"<source port='/a${b'/>", "1:17 error unterminated-define", "close it with '}'"},
      {"<define name='b'>b</define>\n<source port='/a${b/${b}'/>", "2:17 error unterminated-define",
       "close it with '}'"},
      {"<define name=' '>b</define>", "1:15 error empty-name", "the name of a define is empty"},
      {"<define>b</define>", "1:1 error missing-attribute", "lacks the attribute name"},
      {"<define name='a}b'>b</define>", "1:15 error invalid-name", "$ { }"},
      {"<define name='a'><b/></define>", "1:18 error unknown-element", "<define> takes text only"},
      {"<define name='a' value='b'/>", "1:18 error unknown-attribute",
       "\"value\"; write the value between the tags: <define name="},
  };
  for (const Case& c : cases) {
    const Loaded loaded = load_text(c.model);
    EXPECT_THAT(loaded.findings(), ElementsAre(c.finding)) << c.model;
    EXPECT_THAT(loaded.message(), HasSubstr(c.message)) << c.model;
  }
}

TEST(Defines, OneInAFileThatComesLaterIsToldWithThatFile) {
  const Loaded loaded =
      load_texts({"<behaviors><behavior name='A'><config at='${gaze}'>/s</config></behavior>"
                  "<source port='${gase}'/></behaviors>",
                  "<behaviors/>", "<define name=' gaze '>/p</define>"});
  EXPECT_THAT(loaded.message(0), HasSubstr("${gaze} is used before it is defined, in "));
  EXPECT_THAT(loaded.message(0), HasSubstr("c.xml; give that file before this one"));
  EXPECT_THAT(loaded.message(1), HasSubstr("no define has the name \"gase\""));
}

TEST(Defines, AreLookedForInALaterFileWithoutEndInOnePass) {
  std::string endless;
  for (int i = 0; i < 1'000'000; ++i) endless += "<define ";
  const Loaded loaded = load_texts({"<source port='${gaze}'/>", endless});
  EXPECT_THAT(loaded.message(0), HasSubstr("no define has the name \"gaze\""));
}

TEST(Defines, OneThatCannotBeReadDoesNotMakeItsUsesWrong) {
  EXPECT_THAT(load_text(R"(<define name="a">${nowhere}</define>
<define name="b">${a}</define>
<source port="${a}"/><source port="${b}"/>)")
                  .findings(),
              ElementsAre("1:18 error unknown-define"));
  EXPECT_THAT(load_text("<define nam='a'>/a</define>\n<source port='${a}'/>").findings(),
              ElementsAre("1:1 error missing-attribute", "1:9 error unknown-attribute"));
  EXPECT_THAT(load_texts({"<define name='a'>/a</defin>", "<source port='${a}'/>"}).findings(true),
              ElementsAre("a.xml:1:20 error malformed-xml"));
}

TEST(Defines, ThatDoubleEachOtherEndAtALimit) {
  std::string model = "<define name='a0'>lol lol </define>";
  for (int i = 1; i < 60; ++i) {
    const std::string use = "${a" + std::to_string(i - 1) + "}";
    model += "\n<define name='a" + std::to_string(i) + "'>" + use + use + "</define>";
  }
  const Stopwatch stopwatch;
  const Loaded loaded = load_text(model + "\n<source port='/${a59}'/>");
  EXPECT_LT(stopwatch.seconds(), 2.0);
  ASSERT_EQ(loaded.items.size(), 1u) << "those that use it are no further mistakes";
  EXPECT_EQ(loaded.items[0].code, "limit-exceeded");
  EXPECT_THAT(loaded.message(), HasSubstr("more than the limit of 64 KiB"));
}

TEST(Defines, OfManyTextsTogetherEndAtALimit) {
  std::string model = "<define name='a'>" + std::string(60'000, 'x') + "</define>\n";
  for (int i = 0; i < 100'000; ++i) model += "<source port='/${a}'/>";
  const Stopwatch stopwatch;
  const Loaded loaded = load_text(model);
  EXPECT_LT(stopwatch.seconds(), 10.0);
  EXPECT_EQ(loaded.items.back().code, "limit-exceeded");
  EXPECT_THAT(loaded.items.back().message, HasSubstr("the limit of 64 MiB in all"));
}

}  // namespace
}  // namespace arbiter::rules
