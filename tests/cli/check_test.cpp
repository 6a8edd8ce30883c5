#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>

#include <nlohmann/json.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

TEST(Check, SumsUpAModelThatIsFine) {
  TemporaryDirectory directory;
  const auto result = arbiter({"check", directory.write("m.xml", kOverrideModel)});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "ok: 1 port, 2 connections, 2 sources\n");
  EXPECT_EQ(result.err, "");
}

TEST(Check, TakesAModelInSeveralFilesBeforeAndAfterOptions) {
  TemporaryDirectory directory;
  const auto low = directory.write(
      "low.xml", R"(<behavior name="Low"><config at="/p">/low</config></behavior>)");
  const auto high = directory.write(
      "high.xml",
      R"(<behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition></behavior>)");
  const auto application =
      directory.write("app.xml",
                      "<application><connection><from>/low</from><to>/p</to></connection>"
                      "<connection><from>/high</from><to>/p</to></connection>"
                      "<connection><from>/other</from><to>/q</to></connection></application>");
  const auto result = arbiter({"check", low, "--application", application, high});
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(result.out, "ok: 2 ports, 3 connections, 3 sources\n");
  EXPECT_EQ(result.exit_code, 0);
}

TEST(Check, ExplainsAConflictWithItsWitness) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kConflictModel);
  const auto result = arbiter({"check", model});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "failed: 1 error\n");
  EXPECT_THAT(result.err, StartsWith(model + ":3:"));
  EXPECT_THAT(result.err, HasSubstr(": error: /b and /a (" + model + ":2:"));
  EXPECT_THAT(result.err, HasSubstr("[both-can-win]\n"
                                    "    3 |   <behavior name=\"B\"><config at=\"/p\">/b</config>"
                                    "<condition>not /c</condition></behavior>\n"
                                    "      |                      ^\n"
                                    "  active: /a, /b; inactive: /c\n"));
}

TEST(Check, WritesTheSameAsJson) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kConflictModel);
  const auto result = arbiter({"check", "--json", model});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "");
  const auto found = nlohmann::json::parse(result.out);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0]["severity"], "error");
  EXPECT_EQ(found[0]["code"], "both-can-win");
  EXPECT_EQ(found[0]["file"], model);
  EXPECT_EQ(found[0]["line"], 3);
  EXPECT_EQ(found[0]["help"],
            "let one inhibit the other, give one a condition that excludes the other, or let "
            "document order decide with <arbiter at=\"/p\" conflict=\"first\"/>");
  EXPECT_EQ(found[0]["witness"], nlohmann::json::parse(R"({"active": ["/a", "/b"],
                                                           "inactive": ["/c"], "shortest": true})"));
}

// A condition that names a source of another host in vain requires nothing of it.
TEST(Check, OfHostsIsSilentAboutWhatDecidesNothing) {
  TemporaryDirectory directory;
  const auto model = directory.write(
      "m.xml",
      "<behaviors><source port='/Man:o' timeout='forever'/><behavior name='Drive'>"
      "<config at='/Base:i'>/Nav:o</config><condition>/Man:o or not /Man:o</condition></behavior>"
      "</behaviors>");
  const auto modules = directory.write("app.xml",
                                       "<application>"
                                       "<module><name>Base</name><node>a</node></module>"
                                       "<module><name>Nav</name><node>a</node></module>"
                                       "<module><name>Man</name><node>b</node></module>"
                                       "</application>");
  const auto result = arbiter({"check", model, "--hosts", modules, "--silence", "crosses-network"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
}

TEST(Check, WritesAnEmptyArrayOfJsonIfNothingWasFound) {
  TemporaryDirectory directory;
  const auto result = arbiter({"check", directory.write("m.xml", kOverrideModel), "--json"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "[]\n");
  EXPECT_EQ(result.err, "");
}

TEST(Check, AWarningIsNoError) {
  TemporaryDirectory directory;
  const auto result = arbiter(
      {"check", directory.write(
                    "m.xml", R"(<arbiter at="/p"><select from="/a">not /a</select></arbiter>)")});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("warning: /a can never win at /p"));
  EXPECT_THAT(result.err, HasSubstr("[never-selected]\n    1 | "));
  EXPECT_EQ(result.out, "ok: 1 port, 1 connection, 1 source\n");
}

// The stop is declared under one name, and read under another.
const std::string kMisspeltModel = R"(<behaviors>
  <source port="/safety/estop:o"/>
  <behavior name="Drive"><config at="/Base/vel:i">/Nav/vel:o</config>
    <condition>not /safety/estopp:o</condition></behavior>
</behaviors>
)";

TEST(Check, WarnsOfAnEmergencyStopThatNobodyHas) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kMisspeltModel);
  const auto result = arbiter({"check", model, "--silence", "nobody-wins"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr(model + ":2:3: warning: no rule reads or selects "
                                            "/safety/estop:o, which is declared here: "));
  EXPECT_THAT(result.err, HasSubstr(model +
                                    ":4:20: warning: the name /safety/estopp:o stands only "
                                    "here, and nothing declares it; did you mean "
                                    "/safety/estop:o, as at " +
                                    model + ":2:17?"));
}

TEST(Check, StrictTakesWarningsForErrorsButForSilencedOnes) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kMisspeltModel);
  auto result = arbiter({"check", model, "--strict"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "failed: 2 errors, 1 note (--strict treats warnings as errors)\n");
  EXPECT_THAT(result.err, HasSubstr(model + ":4:20: error: the name /safety/estopp:o "));
  result = arbiter({"check", model, "--strict", "--json"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(nlohmann::json::parse(result.out)[0]["severity"], "error");
  result = arbiter({"check", model, "--strict", "--silence", "never-read,similar-name"});
  EXPECT_EQ(result.exit_code, 0) << result.out;
}

TEST(Check, ReportsMalformedFiles) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", "<behaviors>");
  const auto result = arbiter({"check", model});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "failed: 1 error\n");
  EXPECT_THAT(result.err, HasSubstr(model + ":1:"));
  EXPECT_THAT(result.err, HasSubstr("error: "));
}

TEST(Check, NotesWhereNobodyWinsAndWhoIsStarved) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  const auto result = arbiter({"check", model});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "ok: 1 port, 2 connections, 3 sources\n");
  EXPECT_THAT(result.err, HasSubstr("note: with /collision and /object active, nobody wins at /arm "
                                    "although /object is connected there and active; "));
  EXPECT_THAT(result.err, HasSubstr("note: at /arm, /object silences /rest even while /collision "
                                    "silences /object: with /collision, /object and /rest active, "
                                    "nobody wins; "));
  EXPECT_THAT(result.err, EndsWith("2 notes\n"));
}

TEST(Check, TellsEachCauseOfNobody) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", R"(<behaviors>
  <behavior name="Low"><config at="/B:i">/Low:o</config></behavior>
  <behavior name="Mid"><config at="/B:i">/Mid:o</config>
    <condition>/Enable:o</condition><inhibition>Low</inhibition></behavior>
  <behavior name="Top"><config at="/B:i">/Top:o</config>
    <condition>not /Fault:o</condition><inhibition>Mid, Low</inhibition></behavior>
</behaviors>
)");
  EXPECT_THAT(arbiter({"check", model}).err,
              HasSubstr("  so too with /Mid:o active and /Enable:o and /Top:o inactive\n"));
  const auto found = nlohmann::json::parse(arbiter({"check", model, "--json"}).out);
  const auto of_nobody = std::find_if(
      found.begin(), found.end(), [](const auto& each) { return each["code"] == "nobody-wins"; });
  ASSERT_NE(of_nobody, found.end());
  EXPECT_EQ((*of_nobody)["more_witnesses"],
            nlohmann::json::parse(R"([{"active": ["/Mid:o"], "inactive": ["/Enable:o", "/Top:o"],
                                   "shortest": true}])"));
}

TEST(Check, NotesAndWarningsCanBeSilencedAndErrorsCannot) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  auto result = arbiter({"check", model, "--silence", "nobody-wins,starved"});
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(result.exit_code, 0);
  result = arbiter({"check", "--silence", "nobody-wins", "--silence", "starved", model});
  EXPECT_EQ(result.err, "");
  for (const std::string code : {"both-can-win", "refuted", "cycle", "no-statements"}) {
    result = arbiter({"check", model, "--silence", code});
    EXPECT_EQ(result.exit_code, 2) << code;
    EXPECT_THAT(result.err, HasSubstr('"' + code + "\". Errors cannot be silenced; "));
  }
}

TEST(Check, AModelIsNoApplicationThatSaysWhereModulesRun) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  const auto result = arbiter({"check", model, "--hosts", model});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("[not-an-application]"));
}

TEST(Check, AStatementInPlaceOfAFileIsToldApart) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  const auto result = arbiter({"check", model, "--assert", "/object -> winner(/arm) = /object"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("; --assert takes a file, with a statement on each line"));
}

TEST(Check, ACodeThatThereIsNotCannotBeSilenced) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  const auto result = arbiter({"check", model, "--silence", "nobody-wins,starving"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("\"starving\""));
  EXPECT_THAT(result.err, HasSubstr("proved, similar-name, source-on-two-hosts, starved"));
  EXPECT_THAT(arbiter({"check", model, "--silence", "straved"}).err,
              HasSubstr("did you mean \"starved\"?"));
}

TEST(Check, WhatAMappingFeedsIsPublished) {
  TemporaryDirectory directory;
  const auto model =
      directory.write("m.xml",
                      "<behaviors><behavior name='Drive'><config at='/Base:i'>/Nav:o</config>"
                      "<condition>not /EStop/pressed:o</condition></behavior></behaviors>");
  const auto application = directory.write(
      "a.xml",
      "<application><module><name>/Nav</name></module><module><name>/Base</name></module>"
      "<connection><from>/Nav:o</from><to>/Base:i</to></connection></application>");
  const auto mapping = directory.write(
      "g.xml",
      "<gateway kind='dds'><in topic='/stop' type='std_msgs/msg/Bool' true='/EStop/pressed:o' "
      "false='/EStop/released:o'/></gateway>");
  const std::vector<std::string> alone{"check", model, "--application", application};
  EXPECT_THAT(arbiter(alone).err, HasSubstr("never-published"));
  auto beside = alone;
  beside.insert(beside.end(), {"--gateway", mapping});
  EXPECT_THAT(arbiter(beside).err, testing::Not(HasSubstr("never-published")));
}

// A mapping is no model: what decides stands there.
TEST(Check, AdviceOnAMappingIsNotThatOnAModel) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const auto err_of = [&](const std::string& attributes, const char* element) {
    const auto mapping = directory.write("g.xml", "<gateway kind='dds'><" + std::string(element) +
                                                      " topic='/o' type='a/msg/B' port='/object' " +
                                                      attributes + "/></gateway>");
    return arbiter({"check", model, "--gateway", mapping}).err;
  };
  EXPECT_THAT(err_of("timeout='1s'", "in"),
              HasSubstr("; the model says how long a source stays active: write <source port="));
  EXPECT_THAT(err_of("timeout='1s'", "out"),
              HasSubstr("no attribute \"timeout\"; it takes port, topic, "));
  EXPECT_THAT(err_of("priority='1'", "in"), HasSubstr("; the model decides who wins: name there "));
}

// As docs/importing.md has a lock that is latched: the second source is declared for its T alone.
TEST(Check, WhatAMappingFeedsIsDeclaredForItsT) {
  TemporaryDirectory directory;
  const std::string mapping =
      directory.write("g.xml",
                      "<gateway kind='dds'><in topic='/pause' type='std_msgs/msg/Bool' "
                      "true='/pause/active:o' false='/pause/released:o' qos='latched'/></gateway>");
  const auto err_of = [&](const std::string& released, const std::string& condition) {
    const auto model = directory.write(
        "m.xml", "<behaviors><source port='/pause/active:o' timeout='forever'/><source port='" +
                     released +
                     "' timeout='forever'/><arbiter at='/Base:i'><select from='/Nav:o'>" +
                     condition + "</select></arbiter></behaviors>");
    return arbiter({"check", model, "--gateway", mapping}).err;
  };
  EXPECT_EQ(err_of("/pause/released:o", "not /pause/active:o").find("never-read"),
            std::string::npos);
  EXPECT_THAT(err_of("/pause/relased:o", "not /pause/active:o"), HasSubstr("never-read"))
      << "the mapping brings another one";
  EXPECT_THAT(err_of("/pause/released:o", "not /pause/active:o and not /pause/relased:o"),
              HasSubstr("never-read"))
      << "it is meant where a name is misspelt";
}

// Whatever reading and checking may find, by the text of the program.
TEST(Check, ADefineThatNothingUsesIsNotedAndNeverAWarning) {
  TemporaryDirectory directory;
  const auto model = directory.write(
      "m.xml",
      "<behaviors>\n  <define name='free'>not /bumper:o</define>\n  <behavior name='B'>"
      "<config at='/p:i'>/s:o</config></behavior></behaviors>");
  const auto noted = arbiter({"check", model, "--strict"});
  EXPECT_EQ(noted.exit_code, 0);
  EXPECT_THAT(noted.err, StartsWith(model + ":2:17: note: nothing uses the define \"free\""));
  EXPECT_EQ(arbiter({"check", model, "--silence", "unused-define"}).err, "");
}

TEST(Check, WithHostsANegationIsShownInTheConditionThatHasIt) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml",
                                     "<behaviors>\n"
                                     "<behavior name='Look'><config at='/Gaze:i'>/Eye:o</config>"
                                     "</behavior>\n"
                                     "<behavior name='Rest'><config at='/Arm:i'>/Rest:o</config>\n"
                                     "  <condition>not /Eye:o</condition></behavior></behaviors>");
  std::string modules;
  for (const auto& [name, node] : std::vector<std::pair<std::string, std::string>>{
           {"Arm", "a"}, {"Rest", "a"}, {"Eye", "b"}, {"Gaze", "b"}}) {
    modules += "<module><name>" + name + "</name><node>" + node + "</node></module>";
  }
  const auto hosts = directory.write("h.xml", "<application>" + modules + "</application>");
  EXPECT_THAT(arbiter({"check", model, "--hosts", hosts}).err,
              HasSubstr(model + ":4:3: warning: /Eye:o is on b, and a rule at /Arm:i on a"));
}

TEST(Check, EachCodeOfAWarningOrANoteIsOnThePageAndCanBeSilenced) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  const std::regex made(R"re((warning|note)\(\s*"([a-z-]+)")re");
  std::set<std::string> codes;
  for (const char* folder : {"/../../rules", "/../../gateway/mapping"}) {
    for (const auto& file :
         std::filesystem::recursive_directory_iterator(std::string(ARBITER_TEST_DATA) + folder)) {
      if (file.path().extension() != ".cpp") continue;
      const std::string text = content_of(file.path());
      for (std::sregex_iterator each(text.begin(), text.end(), made), end; each != end; ++each) {
        codes.insert((*each)[2]);
      }
    }
  }
  EXPECT_GE(codes.size(), 15u);
  const std::string page = content_of(std::string(ARBITER_TEST_DATA) + "/../../docs/checking.md");
  for (const std::string& code : codes) {
    EXPECT_EQ(arbiter({"check", model, "--silence", code}).exit_code, 0) << code;
    EXPECT_NE(page.find("`" + code + "`"), std::string::npos) << "checking.md lacks " << code;
  }
}

TEST(Check, AGatewaysMappingIsLookedAtBesideTheModel) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kTrackModel);
  const auto good = directory.write(
      "good.xml", "<gateway kind='dds'><in topic='/o' type='a/msg/B' port='/object'/></gateway>");
  const auto bad =
      directory.write("bad.xml",
                      "<gateway kind='dds'>\n<in topic='/o' type='a/msg/B' port='/objekt'/>\n"
                      "<in topic='/o' type='a/msg/B' port='/object'/></gateway>");
  EXPECT_EQ(arbiter({"check", model, "--gateway", good}).exit_code, 0);
  const auto both = arbiter({"check", model, "--gateway", good, "--gateway", bad});
  EXPECT_EQ(both.exit_code, 1);
  EXPECT_NE(both.err.find("bad.xml:2:37: warning: the model does not mention \"/objekt\""),
            std::string::npos)
      << both.err;
  EXPECT_NE(both.err.find("bad.xml:3:37: error: the port \"/object\" has an entry already, at "),
            std::string::npos)
      << both.err;
  EXPECT_NE(both.out.find("failed: "), std::string::npos) << both.out;
  EXPECT_EQ(arbiter({"check", model, "--gateway", directory.file("none.xml")}).exit_code, 2);
}

}  // namespace
}  // namespace arbiter::test
