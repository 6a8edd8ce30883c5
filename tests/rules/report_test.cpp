#include "rules/ask/report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include <nlohmann/json.hpp>

#include "rules/prove/winners.hpp"
#include "rules/text/names.hpp"

namespace arbiter::test {
namespace {

using rules::Diagnostics;

std::string printed(const Diagnostics& diagnostics) {
  std::ostringstream out;
  write_text(out, diagnostics);
  return out.str();
}

nlohmann::json json_of(const Diagnostics& diagnostics) {
  std::ostringstream out;
  write_json(out, diagnostics);
  return nlohmann::json::parse(out.str());
}

TEST(Report, SaysNothingIfNothingWasFound) {
  EXPECT_EQ(printed({}), "");
  EXPECT_EQ(json_of({}), nlohmann::json::array());
}

TEST(Report, WritesAsCompilersDoAndCounts) {
  Diagnostics diagnostics;
  diagnostics.note("some-note", {"m.xml", 3, 4}, "by the way");
  diagnostics.error("both-can-win", {"m.xml", 9, 1}, "both win", {},
                    rules::Witness{{"/a", "/b"}, {"/c"}, true});
  diagnostics.error("both-can-win", {"m.xml", 10, 1}, "both win", {},
                    rules::Witness{{"/a"}, {}, true});
  EXPECT_EQ(printed(diagnostics),
            "m.xml:9:1: error: both win [both-can-win]\n"
            "  active: /a, /b; inactive: /c\n"
            "m.xml:10:1: error: both win [both-can-win]\n"
            "  active: /a; inactive: none\n"
            "m.xml:3:4: note: by the way [some-note]\n"
            "2 errors, 1 note\n");
}

TEST(Report, PrintsNoControlCharacterOfAFilesName) {
  Diagnostics diagnostics;
  diagnostics.error("some-error", {"m\x1b[2J.xml", 9, 1}, "bad");
  EXPECT_EQ(printed(diagnostics), "m\\x1b[2J.xml:9:1: error: bad [some-error]\n1 error\n");
}

TEST(Report, CallsNoWitnessAShortestThatIsNotKnownToBe) {
  Diagnostics diagnostics;
  diagnostics.error("both-can-win", {"m.xml", 1, 1}, "both win", {},
                    rules::Witness{{"/a"}, {"/b"}});
  EXPECT_THAT(
      printed(diagnostics),
      testing::HasSubstr("inactive: /b (nothing of it can be left out; others may be shorter)\n"));
  EXPECT_EQ(json_of(diagnostics)[0]["witness"]["shortest"], false);
}

TEST(Report, DoesNotRepeatAWitnessThatTheMessageHasInWords) {
  Diagnostics diagnostics;
  diagnostics.note("n", {"m.xml", 1, 1}, "with /a active and /b inactive, nobody wins", {},
                   rules::Witness{{"/a"}, {"/b"}, true});
  std::vector<std::string> many;
  for (int i = 0; i < 8; ++i) many.push_back("/s" + std::to_string(i));
  const rules::Witness large{many, {}, true};
  diagnostics.note("n", {"m.xml", 2, 1}, "with " + in_words(large), {}, large);
  EXPECT_EQ(printed(diagnostics),
            "m.xml:1:1: note: with /a active and /b inactive, nobody wins [n]\n"
            "m.xml:2:1: note: with /s0, /s1, /s2, /s3, /s4, /s5 and 2 more active [n]\n"
            "  active: /s0, /s1, /s2, /s3, /s4, /s5, /s6, /s7; inactive: none\n"
            "2 notes\n");
}

// No two of them are alike.
std::string sentence(std::uint32_t i) {
  std::string word;
  for (; i > 0; i /= 26) word += static_cast<char>('a' + i % 26);
  return "a note x" + word;
}

TEST(Report, ShowsTheFirstNotesOfACodeAndCountsTheRest) {
  Diagnostics diagnostics;
  for (std::uint32_t i = 0; i < 25; ++i) diagnostics.note("n", {"m.xml", i + 1, 1}, sentence(i));
  for (std::uint32_t i = 0; i < 12; ++i) diagnostics.warning("w", {"m.xml", i + 1, 1}, "careful");
  const std::string text = printed(diagnostics);
  EXPECT_NE(text.find("m.xml:10:1: note"), std::string::npos);
  EXPECT_EQ(text.find("m.xml:11:1: note"), std::string::npos);
  EXPECT_NE(text.find("m.xml:12:1: warning"), std::string::npos);
  EXPECT_TRUE(
      text.ends_with("\n15 more notes [n] are not shown; arbiter check --json has them\n"
                     "12 warnings, 25 notes\n"));
  EXPECT_EQ(json_of(diagnostics).size(), 37u);
}

TEST(Report, ShowsOneOfManyNotesThatDifferInNamesOnlyAndThePlacesOfTheOthers) {
  Diagnostics diagnostics;
  const auto add = [&](const char* file, std::uint32_t line, const std::string& port,
                       const std::string& sources) {
    diagnostics.note("n", {file, line, 1},
                     "with " + sources + " active, nobody wins at " + port + " (one of " +
                         std::to_string(line) + " causes); connect \"Rest " + port + "\" there",
                     {.ports = {port}});
  };
  add("m.xml", 1, "/a:i", "/x");
  add("m.xml", 2, "/b:i", "/x and /y");
  add("m.xml", 3, "/c:i", "/x, /y, /z and 4 more");
  add("m.xml", 4, "/d:i", "/y");
  diagnostics.note("other", {"m.xml", 5, 1}, "with /x active, nobody wins at /a:i; connect it");
  EXPECT_EQ(json_of(diagnostics).size(), 5u);
  EXPECT_THAT(printed(diagnostics), testing::HasSubstr("m.xml:4:1: note: with /y active"));
  // It is the only such cause.
  diagnostics.note("n", {"k.xml", 6, 1},
                   "with /x active, nobody wins at /e:i; connect \"Rest\" there",
                   {.ports = {"/e:i"}});
  EXPECT_EQ(printed(diagnostics),
            "m.xml:1:1: note: with /x active, nobody wins at /a:i (one of 1 causes); connect "
            "\"Rest /a:i\" there [n]\n"
            "  and 4 more of this kind, each with its own names: line 2 (/b:i), line 3 (/c:i), "
            "line 4 (/d:i), k.xml:6:1 (/e:i); "
            "arbiter check --json has each\n"
            "m.xml:5:1: note: with /x active, nobody wins at /a:i; connect it [other]\n"
            "6 notes\n");
  for (std::uint32_t line = 7; line < 17; ++line) add("m.xml", line, "/f:i", "/x");
  EXPECT_THAT(printed(diagnostics),
              testing::HasSubstr("  and 14 more of this kind, each with its own names: line 2 "
                                 "(/b:i), line 3 (/c:i), line 4 "
                                 "(/d:i), line 7 (/f:i), line 8 (/f:i), line 9 (/f:i), line 10 "
                                 "(/f:i), line 11 (/f:i), line 12 (/f:i), …; arbiter check"));
  EXPECT_EQ(json_of(diagnostics).size(), 16u);
}

TEST(Report, PutsErrorsBeforeWarningsBeforeNotes) {
  Diagnostics diagnostics;
  diagnostics.note("n", {"m.xml", 1, 1}, "third");
  diagnostics.warning("w", {"m.xml", 2, 1}, "second");
  diagnostics.error("e", {"m.xml", 3, 1}, "first");
  std::vector<std::string> messages;
  for (const auto& item : json_of(diagnostics)) messages.push_back(item["message"]);
  EXPECT_EQ(messages, (std::vector<std::string>{"first", "second", "third"}));
}

TEST(Report, SaysHowManyMoreThereAreBeyondTheBoundOfACode) {
  constexpr std::uint32_t kBound = Diagnostics::kMaxOfCode;
  Diagnostics diagnostics;
  for (std::uint32_t i = 0; i < kBound + 3; ++i) {
    diagnostics.note("n", {"m.xml", i + 1, 1}, sentence(i));
    diagnostics.error("e", {"m.xml", i + 1, 1}, "wrong");
  }
  diagnostics.error("other", {"m.xml", 1, 1}, "wrong, too");
  EXPECT_EQ(counts(diagnostics), "10004 errors, 10003 notes");
  EXPECT_TRUE(printed(diagnostics)
                  .ends_with("\n3 more errors [e] were found and are not listed\n"
                             "9993 more notes [n] are not shown; arbiter check --json has the "
                             "first 10000\n10004 errors, 10003 notes\n"));
  const auto json = json_of(diagnostics);
  ASSERT_EQ(json.size(), 2 * kBound + 3);
  EXPECT_EQ(json[1]["code"], "other");
  const auto& omission = json[2 * kBound + 1];
  EXPECT_EQ(omission["severity"], "error");
  EXPECT_EQ(omission["code"], "not-listed");
  EXPECT_EQ(omission["code_omitted"], "e");
  EXPECT_EQ(omission["count"], 3);
  EXPECT_EQ(omission["line"], kBound);

  diagnostics.silence({"n"});
  EXPECT_EQ(counts(diagnostics), "10004 errors");
  EXPECT_EQ(diagnostics.omissions().size(), 1u);
}

TEST(Report, SilencesWhatIsNoError) {
  Diagnostics diagnostics;
  diagnostics.error("a", {"m.xml", 1, 1}, "one");
  diagnostics.warning("a", {"m.xml", 2, 1}, "two");
  diagnostics.note("b", {"m.xml", 3, 1}, "three");
  diagnostics.note("c", {"m.xml", 4, 1}, "four");
  diagnostics.silence({"a", "b", "unknown"});
  EXPECT_EQ(counts(diagnostics), "1 error, 1 note");
  EXPECT_TRUE(diagnostics.has_errors());
}

TEST(Report, CountsOneAsOne) {
  Diagnostics diagnostics;
  diagnostics.error("e", {"m.xml", 1, 1}, "one");
  diagnostics.warning("w", {"m.xml", 2, 1}, "two");
  diagnostics.warning("w", {"m.xml", 3, 1}, "three");
  EXPECT_TRUE(printed(diagnostics).ends_with("\n1 error, 2 warnings\n"));
}

TEST(Report, GoesThroughEachFileFromTheTop) {
  Diagnostics diagnostics;
  diagnostics.error("e", {"b.xml", 7, 1}, "third");
  diagnostics.error("e", {"a.xml", 1, 1}, "fourth");
  diagnostics.error("e", {"b.xml", 2, 9}, "second");
  diagnostics.error("e", {"b.xml", 2, 8}, "first");
  std::vector<std::string> messages;
  for (const auto& item : json_of(diagnostics)) messages.push_back(item["message"]);
  EXPECT_EQ(messages, (std::vector<std::string>{"first", "second", "third", "fourth"}));
}

TEST(Report, WritesJsonForPrograms) {
  Diagnostics diagnostics;
  diagnostics.warning("never-selected", {"m.xml", 3, 4}, "a \"quoted\" message");
  diagnostics.error("both-can-win", {"m.xml", 5, 6}, "both; mend it", {},
                    rules::Witness{{"/a"}, {}, true});
  EXPECT_EQ(json_of(diagnostics), nlohmann::json::parse(R"([
    {"severity": "error", "code": "both-can-win", "file": "m.xml", "line": 5, "column": 6,
     "message": "both; mend it", "help": "mend it", "witness": {"active": ["/a"], "inactive": [], "shortest": true},
     "more_witnesses": [],
     "port": null, "ports": [], "source": null, "behaviour": null, "statement": null,
     "winners": []},
    {"severity": "warning", "code": "never-selected", "file": "m.xml", "line": 3, "column": 4,
     "message": "a \"quoted\" message", "help": null, "witness": null,
     "more_witnesses": [],
     "port": null, "ports": [], "source": null, "behaviour": null, "statement": null,
     "winners": []}])"));
}

TEST(Report, TakesNoSemicolonOfANameForTheBeginningOfTheHelp) {
  const auto help_of = [](const std::string& message) {
    Diagnostics diagnostics;
    diagnostics.error("e", {"m.xml", 1, 1}, message);
    return json_of(diagnostics)[0]["help"];
  };
  for (const std::string name : {"a; b", "a\"; b", "\"a\"; b\"", "a; \"b", "a;\\", "\\\"; b"}) {
    const std::string quoted = rules::quote(name);
    EXPECT_EQ(help_of("one; rename " + quoted), "rename " + quoted);
    EXPECT_EQ(help_of(quoted + " is one; mend it"), "mend it");
    EXPECT_TRUE(help_of("there is " + quoted).is_null());
  }
  const std::string place = rules::describe({"a; \"b.xml", 3, 4});
  EXPECT_EQ(place, "\"a; 'b.xml\":3:4");
  EXPECT_EQ(help_of("the other one is at " + place + "; remove " + place), "remove " + place);
}

TEST(Report, NamesWhatAFindingIsAboutInFieldsOfTheirOwn) {
  Diagnostics diagnostics;
  diagnostics.error("refuted", {"s.txt", 1, 1}, "false",
                    {.ports = {"/p"},
                     .source = "/a",
                     .behaviour = "Go",
                     .statement = "idle(/p)",
                     .winners = {{"/p", "/a"}, {"/q", std::nullopt}}});
  diagnostics.note("left-open", {"s.txt", 2, 1}, "open", {.ports = {"/p", "/q"}});
  const auto found = json_of(diagnostics);
  EXPECT_EQ(found[0]["port"], "/p");
  EXPECT_EQ(found[0]["source"], "/a");
  EXPECT_EQ(found[0]["behaviour"], "Go");
  EXPECT_EQ(found[0]["statement"], "idle(/p)");
  EXPECT_EQ(found[0]["winners"], nlohmann::json::parse(R"([
    {"port": "/p", "winner": "/a"}, {"port": "/q", "winner": null}])"));
  EXPECT_EQ(found[1]["port"], nullptr) << "not one";
  EXPECT_EQ(found[1]["ports"], (nlohmann::json{"/p", "/q"}));
}

TEST(Report, WritesJsonEvenIfAFilesNameIsNotUtf8) {
  Diagnostics diagnostics;
  diagnostics.error("e", {"m\xff.xml", 1, 1}, "odd");
  EXPECT_EQ(json_of(diagnostics)[0]["file"], "m\xef\xbf\xbd.xml");
}

}  // namespace
}  // namespace arbiter::test
