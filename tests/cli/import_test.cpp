// arbiter import, as it is run by hand; what is imported is tested in tests/importing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <set>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const std::string kMux =
    "topics:\n- {name: nav, topic: nav_vel, timeout: 0.5, priority: 10}\n"
    "- {name: joy, topic: joy_vel, timeout: 0.5, priority: 100}\n";

TEST(Import, WritesAModelThatChecksWithoutWarnings) {
  TemporaryDirectory directory;
  const auto yaml = directory.write("mux.yaml", kMux);
  const std::string folder = directory.path() + "/new/mux";
  const auto result = arbiter({"import", "twist_mux", yaml, "--out-dir", folder});
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(content_of(folder + "/mapping.xml"), HasSubstr("topic=\"/nav_vel\""));
  const auto check = arbiter({"check", folder + "/model.xml", "--strict"});
  EXPECT_EQ(check.exit_code, 0) << check.err;
  // Without files, the model alone goes to standard output.
  const auto printed = arbiter({"import", "twist_mux", yaml});
  EXPECT_EQ(printed.out, content_of(folder + "/model.xml"));
}

TEST(Import, TakesAHyphenForStandardOutput) {
  TemporaryDirectory directory;
  const auto yaml = directory.write("mux.yaml", kMux);
  const std::string mapping = directory.path() + "/mapping.xml";
  const auto plain = arbiter({"import", "twist_mux", yaml});
  EXPECT_EQ(arbiter({"import", "twist_mux", yaml, "-o", "-"}).out, plain.out);
  EXPECT_EQ(arbiter({"import", "twist_mux", yaml, "-o", "-", "--mapping", mapping}).out, plain.out);
  EXPECT_THAT(content_of(mapping), HasSubstr("model.xml"));
  const std::string model = directory.path() + "/model.xml";
  EXPECT_EQ(arbiter({"import", "twist_mux", yaml, "-o", model, "--mapping", "-"}).out,
            content_of(mapping));
  EXPECT_FALSE(std::filesystem::exists("-"));
  const auto both = arbiter({"import", "twist_mux", yaml, "--mapping", "-"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_THAT(both.err, HasSubstr("give one of them a file"));
  EXPECT_EQ(arbiter({"import", "twist_mux", yaml, "-o", "-", "--mapping", "-"}).exit_code, 2);
}

TEST(Import, SuggestsTheKindThatWasMeant) {
  const auto result = arbiter({"import", "twistmux", "mux.yaml"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("no multiplexer is called \"twistmux\"; did you mean "
                                    "\"twist_mux\"?"));
  EXPECT_THAT(arbiter({"import", "mux", "mux.yaml"}).err,
              HasSubstr("; name twist_mux or cmd_vel_mux"));
}

TEST(Import, ErrorsPointIntoTheFileAndNothingIsWritten) {
  TemporaryDirectory directory;
  const auto yaml = directory.write("mux.yaml", kMux + "- {name: x, topic: x, timeout: 0.5}\n");
  const auto model = directory.path() + "/m.xml";
  const auto result = arbiter({"import", "twist_mux", yaml, "-o", model});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, StartsWith(yaml + ":4:3: error: \"x\" has no `priority`"));
  EXPECT_THAT(result.err, HasSubstr("    4 | - {name: x, topic: x, timeout: 0.5}\n"));
  EXPECT_FALSE(std::filesystem::exists(model));
}

TEST(Import, IsRefusedWhereItIsUsedWrongly) {
  TemporaryDirectory directory;
  const auto yaml = directory.write("mux.yaml", kMux);
  const auto code = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "import");
    const auto result = arbiter(arguments);
    EXPECT_NE(result.err, "");
    EXPECT_EQ(result.out, "");
    return result.exit_code;
  };
  EXPECT_EQ(code({"topic_tools", yaml}), 2);
  EXPECT_EQ(code({"twist_mux"}), 2);
  EXPECT_EQ(code({"twist_mux", directory.path() + "/none.yaml"}), 2);
  EXPECT_EQ(code({"twist_mux", directory.path()}), 2);
  EXPECT_EQ(code({"twist_mux", yaml, "--out-dir", directory.path(), "-o", "m.xml"}), 2);
  EXPECT_EQ(code({"twist_mux", yaml, "-o", yaml}), 2);
  EXPECT_EQ(code({"twist_mux", yaml, "--mapping", yaml}), 2);
  EXPECT_EQ(code({"twist_mux", yaml, "-o", directory.path() + "/a", "--mapping",
                  directory.path() + "/a"}),
            2);
  EXPECT_EQ(code({"twist_mux", yaml, "--out-dir", yaml}), 2);
  EXPECT_EQ(code({"twist_mux", yaml, "--type", "Twist"}), 2);
  EXPECT_EQ(code({"twist_mux", yaml, "--output-topic", "cmd vel"}), 2);
  EXPECT_EQ(code({"twist_mux", yaml, "--namespace", "a//b"}), 2);
  EXPECT_EQ(code({"twist_mux", yaml, "--idle", "stop"}), 2);
  EXPECT_EQ(code({"twist_mux", yaml, "--domain", "231"}), 2);
  EXPECT_EQ(code({"twist_mux", yaml, "--domain", "-1"}), 2);
  EXPECT_EQ(code({"twist_mux", yaml, "--node", "/*/mux"}), 2);
  EXPECT_EQ(content_of(yaml), kMux);
}

TEST(Import, TheNamespaceMayBeTheOneThatThePageNames) {
  TemporaryDirectory directory;
  const auto yaml = directory.write("mux.yaml", kMux);
  const auto named = arbiter({"import", "twist_mux", yaml, "--namespace", "/"});
  EXPECT_EQ(named.exit_code, 0) << named.err;
  EXPECT_EQ(named.out, arbiter({"import", "twist_mux", yaml}).out);
}

// Somebody may have changed them by hand.
TEST(Import, ReplacesNoFileUnlessItIsToldTo) {
  TemporaryDirectory directory;
  const auto yaml = directory.write("mux.yaml", kMux);
  for (const std::string there : {"model.xml", "mapping.xml"}) {
    const std::string folder = directory.path() + "/" + there + ".d";
    std::filesystem::create_directory(folder);
    const auto changed = directory.write(there + ".d/" + there, "<!-- mine -->");
    auto result = arbiter({"import", "twist_mux", yaml, "--out-dir", folder});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(changed + " is there already; nothing was written: give "
                                                "another file, or --force to replace it"));
    EXPECT_EQ(content_of(changed), "<!-- mine -->");
    EXPECT_FALSE(
        std::filesystem::exists(folder + (there == "model.xml" ? "/mapping.xml" : "/model.xml")));
    result = arbiter({"import", "twist_mux", yaml, "--out-dir", folder, "--force"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(content_of(changed), HasSubstr("imported from mux.yaml"));
  }
  EXPECT_EQ(arbiter({"import", "twist_mux", yaml, "-o", "/dev/null"}).exit_code, 0);
}

// The command, once it is corrected, must not be refused for what was left of the first.
TEST(Import, LeavesNoMappingOfAModelThatCannotBeWritten) {
  TemporaryDirectory directory;
  const auto yaml = directory.write("mux.yaml", kMux);
  const std::string mapping = directory.file("map.xml");
  const std::vector<std::string> verb{
      "import", "twist_mux", yaml, "-o", directory.file("no-such/m.xml"), "--mapping", mapping};
  auto result = arbiter(verb);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("cannot write "));
  EXPECT_FALSE(std::filesystem::exists(mapping));
  // What was there before is not deleted.
  directory.write("map.xml", "mine");
  std::vector<std::string> forced = verb;
  forced.emplace_back("--force");
  EXPECT_EQ(arbiter(forced).exit_code, 2);
  EXPECT_TRUE(std::filesystem::exists(mapping));
}

// A gateway refuses zeros of a type that has strings, or whose size nobody knows.
TEST(Import, WritesNoMappingThatAGatewayWouldRefuse) {
  TemporaryDirectory directory;
  const auto yaml = directory.write("mux.yaml", kMux);
  const std::string folder = directory.path() + "/mux";
  for (const std::string type : {"nav_msgs/msg/Odometry", "my_msgs/msg/Command"}) {
    const auto result = arbiter(
        {"import", "twist_mux", yaml, "--out-dir", folder, "--type", type, "--idle", "zero"});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, HasSubstr("the mapping would be refused, nothing was written: "));
    EXPECT_THAT(result.err, HasSubstr("[idle-size]; leave out --idle zero"));
    EXPECT_FALSE(std::filesystem::exists(folder));
  }
  const std::string stamped =
      "twist_mux: {ros__parameters: {use_stamped: true, topics: {a: "
      "{topic: a, timeout: 0.5, priority: 1}}}}\n";
  const auto result =
      arbiter({"import", "twist_mux", directory.write("s.yaml", stamped), "--out-dir", folder});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  const auto check =
      arbiter({"check", folder + "/model.xml", "--gateway", folder + "/mapping.xml"});
  EXPECT_EQ(check.exit_code, 0) << check.err;
  EXPECT_THAT(check.err, testing::Not(HasSubstr("no-idle")));
}

// Whoever corrects a file wants to know all that is to be corrected.
TEST(Import, SaysWhatIsWrongWithTheFileAndWithTheMappingInOneRun) {
  TemporaryDirectory directory;
  const std::string folder = directory.path() + "/mux";
  const auto equals =
      "cmd_vel_mux: {ros__parameters: {subscribers: {\n"
      "a: {topic: a, timeout: 0.5, priority: 1, short_desc: A},\n"
      "b: {topic: b, timeout: 0.5, priority: 1, short_desc: B}}}}\n";
  auto result = arbiter({"import", "cmd_vel_mux", directory.write("e.yaml", equals), "--out-dir",
                         folder, "--type", "my_msgs/msg/Command", "--idle", "zero"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("e.yaml:3:39: error: \"a\" and \"b\" have the priority 1"));
  EXPECT_THAT(result.err,
              HasSubstr("arbiter: the mapping would be refused, nothing was written: "));
  EXPECT_THAT(result.err, HasSubstr("[idle-size]; leave out --idle zero"));
  const auto stamped = kMux + "- {name: x, topic: x, timeout: 0.5}\nuse_stamped: true\n";
  result = arbiter({"import", "twist_mux", directory.write("s.yaml", stamped), "--out-dir", folder,
                    "--type", "my_msgs/msg/Command", "--idle", "zero"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("s.yaml:4:3: error: \"x\" has no `priority`"));
  EXPECT_THAT(result.err, HasSubstr("[idle-size]; leave out --idle zero"));
  // Of a mapping that nobody asked for nothing is said.
  result = arbiter({"import", "twist_mux", directory.path() + "/s.yaml", "--idle", "zero"});
  EXPECT_THAT(result.err, testing::Not(HasSubstr("the mapping would be refused")));
  EXPECT_FALSE(std::filesystem::exists(folder));
}

// Nor is it said once for each topic.
TEST(Import, ATypeThatCannotBeIsRefusedTogetherWithAModelThatIsTooLarge) {
  TemporaryDirectory directory;
  std::string both = "topics:\n";
  for (int i = 1; i <= 400; ++i) {
    if (i == 201) both += "locks:\n";
    const std::string n = "n" + std::to_string(i);
    both += "- {name: " + n + ", topic: " + n +
            ", timeout: 0.5, priority: " + std::to_string(1 + i % 255) + "}\n";
  }
  const auto result = arbiter({"import", "twist_mux", directory.write("both.yaml", both),
                               "--out-dir", directory.path() + "/mux", "--type", "a//msg/B"});
  EXPECT_EQ(result.exit_code, 1);
  const auto model = result.err.find("arbiter: the model would be refused, nothing was written: ");
  const auto mapping =
      result.err.find("arbiter: the mapping would be refused, nothing was written");
  ASSERT_NE(model, std::string::npos) << result.err;
  ASSERT_NE(mapping, std::string::npos) << result.err;
  EXPECT_EQ(result.err.find("the mapping would be refused", mapping + 20), std::string::npos);
}

std::string entries(const std::string& name, int count) {
  std::string text;
  for (int i = 1; i <= count; ++i) {
    const std::string n = name + std::to_string(i);
    text += "- {name: " + n + ", topic: " + n +
            ", timeout: 0.5, priority: " + std::to_string(1 + i % 255) + "}\n";
  }
  return text;
}

TEST(Import, AMuxThatIsTooLargeIsRefusedWithItsReason) {
  TemporaryDirectory directory;
  // More than one list may have, and more than a port may have of both.
  const auto many = directory.write("many.yaml", "topics:\n" + entries("t", 4'000));
  auto result = arbiter({"import", "twist_mux", many});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr("`topics` has 4000 entries"));
  const auto both = directory.write(
      "both.yaml", "topics:\n" + entries("t", 200) + "locks:\n" + entries("l", 200));
  result = arbiter({"import", "twist_mux", both, "-o", directory.path() + "/m.xml"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("arbiter: the model would be refused, nothing was written: "));
  EXPECT_FALSE(std::filesystem::exists(directory.path() + "/m.xml"));
}

TEST(Import, EachCodeIsOnThePage) {
  const std::string source = std::string(ARBITER_TEST_DATA) + "/../..";
  const std::regex made(R"re("([a-z]+(-[a-z0-9]+)+)")re");
  std::set<std::string> codes;
  for (const auto& file : std::filesystem::directory_iterator(source + "/importing")) {
    if (file.path().extension() != ".cpp") continue;
    const std::string text = content_of(file.path());
    for (std::sregex_iterator each(text.begin(), text.end(), made), end; each != end; ++each) {
      codes.insert((*each)[1]);
    }
  }
  EXPECT_GE(codes.size(), 25u);
  const std::string page = content_of(source + "/docs/importing.md");
  for (const std::string& code : codes) {
    EXPECT_NE(page.find("`" + code + "`"), std::string::npos) << "importing.md lacks " << code;
  }
}

}  // namespace
}  // namespace arbiter::test
