#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

const std::string kApplication = R"(<?xml version="1.0"?>
<!-- An </application> in a comment ends nothing. -->
<application>
    <name>Test</name>
    <module><name>low</name><parameters>--a "&lt;b>"</parameters></module>
    <connection><from>/low</from><to>/p</to><protocol>tcp</protocol></connection>
    <connection><from>/high</from><to>/p</to></connection>
    <connection><from>/other</from><to>/q</to></connection>
</application>
<!-- The end. -->
)";

TEST(Compile, PutsTheRulesIntoTheApplicationAndLeavesTheRestAsItIs) {
  const TemporaryDirectory directory;
  const auto result = arbiter({"compile", directory.write("m.xml", kOverrideModel), "--application",
                               directory.write("a.xml", kApplication)});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  std::string expected = kApplication;
  expected.insert(expected.rfind("</application>"), R"(
    <arbitration timeout="500ms">
        <!-- Written by arbiter compile: the rules of each input port. -->
        <arbiter at="/p">
            <!-- Low -->
            <select from="/low">/low ∧ ¬/high</select>
            <!-- High -->
            <select from="/high">/high</select>
        </arbiter>
    </arbitration>
)");
  EXPECT_EQ(result.out, expected);
}

TEST(Compile, MakesAnApplicationOfTheConnectionsThatAreConfigured) {
  const TemporaryDirectory directory;
  const auto model = directory.write("night <shift>.xml", kOverrideModel);
  const auto out = directory.path() + "/out.xml";
  EXPECT_EQ(arbiter({"compile", model, "-o", out}).exit_code, 0);
  const std::string written = content_of(out);
  EXPECT_THAT(written, HasSubstr("<name>night &lt;shift&gt;</name>"));
  EXPECT_THAT(written, HasSubstr("<from>/low</from>"));
  EXPECT_EQ(arbiter({"rules", out}).out, arbiter({"rules", model}).out);
  EXPECT_EQ(arbiter({"check", out}).out, "ok: 1 port, 2 connections, 2 sources\n");
}

TEST(Compile, WritesAlsoWhereTheNameHasNoRoomForMoreAndWhereALinkLeads) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const std::string longest = directory.path() + "/" + std::string(255, 'n');
  EXPECT_EQ(arbiter({"compile", model, "-o", longest}).err, "");
  EXPECT_THAT(content_of(longest), HasSubstr("<arbitration"));
  std::filesystem::create_directory(directory.path() + "/to");
  const std::string link = directory.path() + "/link.xml";
  std::filesystem::create_symlink("to/second.xml", link);
  std::filesystem::create_symlink("new.xml", directory.path() + "/to/second.xml");
  for (int i = 0; i < 2; ++i) {  // where nothing is there yet, and again
    EXPECT_EQ(arbiter({"compile", model, "-o", link}).err, "");
    EXPECT_TRUE(std::filesystem::is_symlink(link));
    EXPECT_TRUE(std::filesystem::is_regular_file(
        std::filesystem::symlink_status(directory.path() + "/to/new.xml")));
  }
}

TEST(Compile, RefusesToOverwriteWhatItReads) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const auto application = directory.write("a.xml", kApplication);
  const std::string link = directory.path() + "/link.xml", hard = directory.path() + "/hard.xml";
  std::filesystem::create_symlink("m.xml", link);
  std::filesystem::create_hard_link(application, hard);
  for (const std::string& output :
       {model, link, directory.path() + "/./m.xml", application, hard}) {
    const auto result = arbiter({"compile", model, "--application", application, "-o", output});
    EXPECT_EQ(result.exit_code, 2) << output;
    EXPECT_THAT(result.err, HasSubstr("--output " + output + " would overwrite"));
    EXPECT_EQ(content_of(model), kOverrideModel);
    EXPECT_EQ(content_of(application), kApplication);
  }
  EXPECT_TRUE(std::filesystem::is_symlink(link));
}

TEST(Compile, TakesAModelThatCanBeReadOnce) {
  const TemporaryDirectory directory;
  const auto first = arbiter({"compile", directory.write("m.xml", kOverrideModel), "--application",
                              directory.write("a.xml", kApplication)});
  const auto expected = arbiter({"compile", directory.write("merged.xml", first.out)});
  ASSERT_EQ(expected.exit_code, 0);
  for (const char* const input : {"/dev/stdin", "-"}) {
    const auto result = run_program({ARBITER_PROGRAMS "/arbiter", "compile", input}, first.out);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.out, expected.out);
  }
}

TEST(Compile, TakesItsOwnResultAgain) {
  const TemporaryDirectory directory;
  const auto once = directory.path() + "/once.xml", twice = directory.path() + "/twice.xml";
  arbiter({"compile", directory.write("m.xml", kOverrideModel), "--application",
           directory.write("a.xml", kApplication), "-o", once});
  EXPECT_EQ(arbiter({"compile", once, "-o", twice}).exit_code, 0);
  EXPECT_EQ(arbiter({"rules", twice}).out, arbiter({"rules", once}).out);
  EXPECT_EQ(arbiter({"compile", twice}).out, content_of(twice));
}

TEST(Compile, TakesAnApplicationWithAModelInItBesideOtherFiles) {
  const TemporaryDirectory directory;
  const auto once = directory.path() + "/once.xml", both = directory.path() + "/both.xml";
  arbiter({"compile", directory.write("m.xml", kOverrideModel), "--application",
           directory.write("a.xml", kApplication), "-o", once});
  const auto more = directory.write(
      "more.xml", "<behaviors><arbiter at='/q'><select from='/other'/></arbiter></behaviors>");
  EXPECT_EQ(arbiter({"compile", more, once, "-o", both}).exit_code, 0);
  EXPECT_THAT(content_of(both), HasSubstr("<module>"));
  EXPECT_EQ(arbiter({"rules", both}).out, arbiter({"rules", more, once}).out);
  const auto copy = directory.write("copy.xml", "<application><arbitration/></application>");
  const auto result = arbiter({"compile", once, copy});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("more than one application"));
}

// What no rule mentions has a meaning too: T of each source, and which connection comes first.
TEST(Compile, KeepsTimeoutsAndTheOrderThatConflictsAreDecidedBy) {
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", R"(<behaviors timeout="forever">
    <source port="/low" timeout="250us"/> <source port="/unused"/>
    <behavior name="Low"><config at="/p">/low</config></behavior>
    <behavior name="High"><config at="/p">/high</config></behavior>
    <arbiter at="/p" conflict="first"/>
  </behaviors>)");
  const auto out = directory.path() + "/out.xml";
  EXPECT_EQ(arbiter({"compile", model, "-o", out}).exit_code, 0);
  EXPECT_EQ(arbiter({"check", out}).out, arbiter({"check", model}).out);
  const auto trace =
      directory.write("t.csv", "t_ns,source\n0,/high\n10,/low\n20,/high\n250009,\n250010,\n");
  const auto expected = arbiter({"simulate", model, "--trace", trace});
  EXPECT_THAT(expected.out, HasSubstr("20,/high,/p,discarded,/low\n"));
  EXPECT_EQ(arbiter({"simulate", out, "--trace", trace}).out, expected.out);
}

TEST(Compile, WritesNothingForAModelWithErrors) {
  const TemporaryDirectory directory;
  const auto out = directory.write("out.xml", "as it was");
  const auto result = arbiter({"compile", directory.write("m.xml", kConflictModel), "-o", out});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("both-can-win"));
  EXPECT_EQ(content_of(out), "as it was");
}

TEST(Compile, RefusesAConnectionThatTheApplicationLacks) {
  const TemporaryDirectory directory;
  const auto result = arbiter({"compile", directory.write("m.xml", kOverrideModel), "--application",
                               directory.write("a.xml", "<application/>")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("not-in-application"));
  EXPECT_EQ(result.out, "");
}

// A condition may be as deep as the limit; the rule that it becomes a part of is deeper.
TEST(Compile, SaysSoWhereTheResultCouldNotBeReadAgain) {
  const TemporaryDirectory directory;
  std::string deepest = "/x";
  for (int i = 0; i < 499; ++i) deepest = "not (" + deepest + ")";
  const auto model = directory.write(
      "m.xml", "<behaviors><behavior name=\"A\"><config at=\"/p\">/a</config><condition>" +
                   deepest +
                   "</condition></behavior>"
                   "<behavior name=\"B\"><config at=\"/p\">/a</config></behavior></behaviors>");
  const auto out = directory.write("out.xml", "as it was");
  ASSERT_EQ(arbiter({"rules", model}).exit_code, 0);
  const auto result = arbiter({"compile", model, "-o", out});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("cannot be written as a file that could be read again"));
  EXPECT_EQ(content_of(out), "as it was");
}

TEST(Compile, ReplacesAFileAsAWholeAndKeepsLinksAndModes) {
  namespace fs = std::filesystem;
  const TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const auto target = directory.write("target.xml", "old");
  fs::permissions(target, fs::perms::owner_read | fs::perms::owner_write);
  const auto link = directory.path() + "/link.xml";
  fs::create_symlink("target.xml", link);
  const auto refused = arbiter({"compile", model, "-o", link});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("/link.xml is there already; nothing was written: give"));
  EXPECT_EQ(content_of(target), "old");
  EXPECT_EQ(arbiter({"compile", model, "-o", link, "--force"}).exit_code, 0);
  EXPECT_EQ(arbiter({"compile", model, "-o", link}).exit_code, 0) << "that is there already";
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_THAT(content_of(target), HasSubstr("<arbitration"));
  EXPECT_EQ(fs::status(target).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(std::distance(fs::directory_iterator(directory.path()), fs::directory_iterator()), 3);
}

TEST(Compile, SaysWhichFileCannotBeWritten) {
  const TemporaryDirectory directory;
  const auto result = arbiter({"compile", directory.write("m.xml", kOverrideModel), "-o",
                               directory.path() + "/missing/out.xml"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("cannot write " + directory.path() + "/missing/out.xml"));
}

}  // namespace
}  // namespace arbiter::test
