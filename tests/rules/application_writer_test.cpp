#include "rules/model/application_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string kWritten = "<arbiter at='/p'><select from='/a'>not /b</select></arbiter>";
const std::string kMerged =
    "<arbitration timeout=\"500ms\">\n"
    "  <!-- Written by arbiter compile: the rules of each input port. -->\n"
    "  <arbiter at=\"/p\">\n"
    "   <select from=\"/a\">/a ∧ ¬/b</select>\n"
    "  </arbiter>\n"
    " </arbitration>";

std::string merge(const std::string& model, const std::string& application) {
  return merge_rules(load_text(model).rules, application);
}

// Written, read, and the same again.
std::string round_trip(const std::string& model) {
  const Loaded loaded = load_text(model);
  EXPECT_FALSE(loaded.has_errors) << loaded.message();
  const std::string written = write_application(loaded.rules, "test");
  const Loaded again = load_text(written);
  EXPECT_FALSE(again.has_errors) << again.message() << "\n" << written;
  EXPECT_TRUE(same_rules(loaded.rules, again.rules)) << written;
  return written;
}

TEST(ApplicationWriter, PutsTheRulesLastIntoTheRootInTheStyleOfTheFile) {
  EXPECT_EQ(merge(kWritten, "<application>\n <name>x</name>\n</application>\n<!-- end -->\n"),
            "<application>\n <name>x</name>\n\n " + kMerged + "\n</application>\n<!-- end -->\n");
  const std::string crlf = merge(kWritten, "<application>\r\n\t<name/>\r\n</application>\r\n");
  EXPECT_THAT(crlf, HasSubstr("\r\n\t\t<arbiter at=\"/p\">\r\n"));
  for (std::size_t at = crlf.find('\n'); at != std::string::npos; at = crlf.find('\n', at + 1)) {
    EXPECT_EQ(crlf[at - 1], '\r');
  }
}

TEST(ApplicationWriter, TakesWhateverTheRootLooksLike) {
  for (const std::string application :
       {"<application/>", "<application />", "<application></application>",
        "<?xml version='1.0'?><!-- <application> --><application a='/>'/><!-- -->",
        "<application><name>x</name></application>"}) {
    const std::string merged = merge(kWritten, application);
    const Loaded read = load_text(merged.substr(0, merged.find("</application>")) +
                                  "<connection><from>/a</from><to>/p</to></connection>" +
                                  merged.substr(merged.find("</application>")));
    EXPECT_FALSE(read.has_errors) << merged;
    EXPECT_TRUE(same_rules(read.rules, load_text(kWritten).rules)) << merged;
  }
}

TEST(ApplicationWriter, ReplacesTheRulesThatWereThere) {
  const std::string before = "<application>\n <name>x</name>\n\n ";
  const std::string after = "\n <connection/>\n</application>\n";
  EXPECT_EQ(merge(kWritten, before + "<arbitration><old/></arbitration>" + after),
            before + kMerged + after);
  EXPECT_EQ(merge(kWritten, before + "<arbitration/>\n <arbitration>\n </arbitration>" + after),
            before + kMerged + after);
}

// Encodings other than UTF-8 take what they lack as references.
TEST(ApplicationWriter, KeepsToTheEncodingOfTheFile) {
  const std::string model = "<arbiter at='/größe'><select from='/a'>not \"/ß\"</select></arbiter>";
  const std::string connection =
      "<connection><from>/a</from><to>/gr\xf6\xdf"
      "e</to></connection>";
  const auto non_ascii = [](const std::string& text) {
    return std::count_if(text.begin(), text.end(), [](char c) { return c < 0; });
  };
  for (const std::string declared : {"<?xml version='1.0' encoding='ISO-8859-1'?>", ""}) {
    const std::string latin = declared + "<application>" + connection + "</application>";
    const std::string merged = merge(model, latin);
    EXPECT_EQ(non_ascii(merged), non_ascii(latin));
    EXPECT_THAT(merged, HasSubstr("/gr&#246;&#223;e"));
  }
  const std::string declared =
      merge(model, "<?xml version='1.0' encoding='us-ascii'?><application></application>");
  EXPECT_EQ(non_ascii(declared), 0);
  const std::string utf8 =
      merge(model, "<?xml version='1.0' encoding='utf-8'?><application></application>");
  EXPECT_THAT(utf8, HasSubstr("<arbiter at=\"/größe\">"));
  const std::string undeclared =
      merge(model, "<application><parameters>--encoding jpeg</parameters></application>");
  EXPECT_THAT(undeclared, HasSubstr("<arbiter at=\"/größe\">"));
}

// Only the model in it must be UTF-8: a name in Latin-1 elsewhere is not ours to judge.
TEST(ApplicationWriter, WhatItWroteIntoALatinFileCanBeRead) {
  const std::string latin =
      "<application><author>J\xf6rg</author><connection><from>/a</from><to>/p</to>"
      "</connection></application>";
  const Loaded read = load_text(merge(kWritten, latin));
  EXPECT_FALSE(read.has_errors) << read.message();
  EXPECT_TRUE(same_rules(read.rules, load_text(kWritten).rules));
}

TEST(ApplicationWriter, NamesAreReadBackAsTheyAre) {
  round_trip(
      "<arbiter at='/p&amp;&lt;&gt;&apos;'><select from='/a|b&amp;&amp;'>"
      "not \"/ß&lt;\" and not \"/x]]>\"</select></arbiter>");
  const std::string dollar = round_trip(
      "<define name='d'>$</define><define name='e'>{x}</define>"
      "<arbiter at='/p$${d}${e}'><select from='/a${d}${e}'>not \"/b${d}${e}\"</select>"
      "</arbiter>");
  EXPECT_THAT(dollar, HasSubstr("<to>/p$${x}</to>"));  // an application has no defines
  EXPECT_THAT(dollar, HasSubstr("at=\"/p$${dollar}{x}\""));
}

TEST(ApplicationWriter, NoNameEndsAComment) {
  const std::string written = round_trip(
      "<behavior name='a--b-->&lt;evil/>---'><config at='/p'>/a</config></behavior>"
      "<behavior name='-'><config at='/p'>/a</config></behavior>");
  EXPECT_THAT(written, HasSubstr("<!-- a- -b- -><evil/>- - -, - -->"));
}

TEST(ApplicationWriter, KeepsWhatNoRuleSays) {
  const std::string written = round_trip(
      "<behaviors timeout='forever'><source port='/a' timeout='250us'/><source port='/unused'/>"
      "<behavior name='A'><config at='/p'>/a</config><condition>none(/x*)</condition></behavior>"
      "<behavior name='B'><config at='/p'>/b</config></behavior>"
      "<arbiter at='/p' conflict='first'/></behaviors>");
  EXPECT_THAT(written, HasSubstr("<arbitration timeout=\"forever\">"));
  EXPECT_THAT(written, HasSubstr("<source port=\"/a\" timeout=\"250us\"/>"));
  EXPECT_THAT(written, HasSubstr("<source port=\"/unused\"/>"));
  EXPECT_THAT(written, Not(HasSubstr("<source port=\"/b\"")));
  EXPECT_THAT(written, HasSubstr("<arbiter at=\"/p\" conflict=\"first\">"));
  round_trip("<behaviors/>");
}

TEST(Arbitration, IsAModelWithinAnApplication) {
  const Loaded loaded = load_text(R"(<application>
    <connection><from>/a</from><to>/p</to></connection>
    <connection><from>/b</from><to>/p</to></connection>
    <connection><from>/a</from><to>/q</to></connection>
    <arbitration timeout="1s">
      <behavior name="A"><config at="/p">/a</config></behavior>
    </arbitration></application>)");
  EXPECT_THAT(loaded.findings(), testing::IsEmpty());
  EXPECT_EQ(loaded.rules.timeout, 1'000'000'000);
  EXPECT_THAT(show_rules(loaded, "/p"), testing::ElementsAre("/a: true"));
  EXPECT_EQ(loaded.rules.other_connections.size(), 2u);
}

TEST(Arbitration, MayOnlyUseConnectionsOfItsApplication) {
  const std::string model = R"(<application><arbitration>
  <behavior name="A"><config at="/p">/a</config></behavior></arbitration></application>)";
  EXPECT_THAT(load_text(model).findings(), testing::ElementsAre("2:22 error not-in-application"));
  // Another application that is given says instead which connections there are.
  const std::string other =
      "<application><connection><from>/a</from><to>/p</to></connection></application>";
  EXPECT_THAT(load_with_application(model, other).findings(), testing::IsEmpty());
}

TEST(Arbitration, OfSeveralApplicationsTheConnectionsAddUp) {
  const auto application = [](const std::string& source) {
    return "<application><connection><from>/same</from><to>/p</to></connection><connection><from>" +
           source + "</from><to>/p</to></connection><arbitration/></application>";
  };
  const Loaded loaded = load_texts({application("/a"), application("/b")});
  EXPECT_THAT(loaded.findings(), testing::ElementsAre("1:68 note not-arbitrated"));
  EXPECT_EQ(loaded.rules.other_connections.size(), 3u);
}

TEST(Arbitration, MistakesHaveTheirPlaces) {
  const auto findings = [](const std::string& text) { return load_text(text).findings(); };
  EXPECT_THAT(findings("<application>\n<arbitration/>\n<arbitration/></application>"),
              testing::ElementsAre("3:1 error duplicate-arbitration"));
  EXPECT_THAT(findings("<application>\n<arbitration wrong='1'><no/></arbitration></application>"),
              testing::ElementsAre("2:14 error unknown-attribute", "2:24 error unknown-element"));
  EXPECT_THAT(findings("<application>\n<arbitration>\xf6</arbitration></application>"),
              testing::ElementsAre("2:14 error invalid-character"));
  EXPECT_THAT(findings("<application><name>x</name></application>"),
              testing::ElementsAre("1:1 error unknown-element"));
}

}  // namespace
}  // namespace arbiter::rules
