// What holds for every verb of the program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <map>
#include <regex>
#include <sstream>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using testing::ContainsRegex;
using testing::EndsWith;
using testing::HasSubstr;
using testing::MatchesRegex;

TEST(Program, TellsItsVersion) {
  const auto result = arbiter({"--version"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, MatchesRegex("arbiter [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

// As --help lists them.
std::vector<std::string> verbs() {
  const auto help = arbiter({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  std::istringstream lines(help.out.substr(help.out.find("\nSubcommands:\n") + 1));
  std::vector<std::string> result;
  std::string line;
  for (std::getline(lines, line); std::getline(lines, line) && !line.empty();) {
    std::istringstream words(line);
    words >> result.emplace_back();
  }
  EXPECT_GE(result.size(), 17u);
  return result;
}

// First the example, then the codes.
void expect_explained(std::vector<std::string> verb) {
  std::string name = "arbiter";
  for (const std::string& word : verb) name += " " + word;
  SCOPED_TRACE(name);
  verb.emplace_back("--help");
  const auto result = arbiter(verb);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, ContainsRegex("\nExamples?:\n  " + name));
  const auto example = result.out.find("\nExample");
  EXPECT_NE(result.out.find("\nExit codes: 0 ", example), std::string::npos) << result.out;
}

TEST(Program, ExplainsEachVerbWithAnExampleAndItsExitCodes) {
  expect_explained({});
  for (const std::string& verb : verbs()) expect_explained({verb});
  for (const char* verb : {"info", "winners", "sample", "repair", "export"}) {
    expect_explained({"recording", verb});
  }
}

TEST(Program, HasNoVerbThatTheReadmeDoesNotName) {
  const std::string readme = content_of(std::string(ARBITER_TEST_DATA) + "/../../README.md");
  for (const std::string& verb : verbs()) {
    EXPECT_NE(readme.find("`" + verb + "`"), std::string::npos)
        << "README.md does not name " << verb;
  }
}

// "arbiter why /Gaze/pos:i --follow" in a page, as words: in a block, where it may go on behind a
// '\\', and between backticks.
std::vector<std::vector<std::string>> commands_in(const std::string& page) {
  static const std::regex kInBlock("(?:\\$ )?arbiter ([^#;|&]+).*"), kInText("`arbiter ([^`]+)`");
  std::vector<std::vector<std::string>> result;
  const auto add = [&](const std::string& command) {
    std::istringstream words(command);
    result.emplace_back(std::istream_iterator<std::string>(words),
                        std::istream_iterator<std::string>());
  };
  std::istringstream lines(page);
  std::string line, more;
  for (bool is_block = false; std::getline(lines, line);) {
    if (line.starts_with("```")) is_block = !is_block;
    while (is_block && line.ends_with('\\') && std::getline(lines, more)) {
      line.back() = ' ';
      line += more;
    }
    std::smatch found;
    if (is_block && std::regex_match(line, found, kInBlock)) add(found[1].str());
    if (is_block) continue;
    for (std::sregex_iterator at(line.begin(), line.end(), kInText), end; at != end; ++at) {
      add((*at)[1].str());
    }
  }
  return result;
}

// Each verb and each option: a page that is not run with the tests tells what there is, too.
TEST(Program, HasEachVerbAndOptionThatAPageWrites) {
  const std::string root = std::string(ARBITER_TEST_DATA) + "/../../";
  const auto known = verbs();
  std::map<std::vector<std::string>, std::string> helps;
  std::vector<std::string> pages{root + "README.md"};
  for (const auto& entry : std::filesystem::directory_iterator(root + "docs")) {
    if (entry.path().extension() == ".md") pages.push_back(entry.path().string());
  }
  std::size_t count = 0;
  for (const std::string& page : pages) {
    for (const auto& words : commands_in(content_of(page))) {
      SCOPED_TRACE(page + ": arbiter " + testing::PrintToString(words));
      const bool is_verb = std::islower(static_cast<unsigned char>(words.front().front())) != 0;
      if (!is_verb || words.front() == "help") continue;  // --help, VERB
      EXPECT_TRUE(std::find(known.begin(), known.end(), words.front()) != known.end());
      std::vector<std::string> verb{words.front()};
      if (verb.front() == "recording" && words.size() > 1) verb.push_back(words[1]);
      std::string& help = helps[verb];
      if (help.empty()) {
        auto asking = verb;
        asking.emplace_back("--help");
        help = arbiter(asking).out;
      }
      for (const std::string& word : words) {
        if (!word.starts_with("--")) continue;
        ++count;
        const std::string option = word.substr(0, word.find_first_of("=,.)"));
        EXPECT_NE(help.find(option), std::string::npos) << option;
      }
    }
  }
  EXPECT_GT(count, 100u) << "does it still read the pages?";
}

TEST(Program, ExitsWith2WhereItIsUsedWrongly) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const std::vector<std::vector<std::string>> wrong = {
      {},
      {"no-such-verb"},
      {"check"},
      {"rules"},
      {"check", "--no-such-option", model},
      {"check", model, "--application"},
      {"check", model, "--application", model, "--application", model},
      {"simulate", model},
      {"simulate", "--trace", model},
      {"check", model, "rules", model}};
  for (const auto& arguments : wrong) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(arguments);
    EXPECT_EQ(result.out, "");
    EXPECT_NE(result.err, "");
  }
}

TEST(Program, HelpOfAVerbIsTheSameEitherWay) {
  const auto same = [](std::vector<std::string> words) {
    words.insert(words.begin(), "help");
    const auto before = arbiter(words);
    words.erase(words.begin());
    words.emplace_back("--help");
    EXPECT_EQ(before.exit_code, 0);
    EXPECT_EQ(before.out, arbiter(words).out);
  };
  same({});
  same({"why"});
  same({"recording", "winners"});
  EXPECT_THAT(arbiter({"help", "wyh"}).err, HasSubstr("did you mean \"why\"?"));
}

TEST(Program, ExitsWith2WhereAFileCannotBeOpened) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", kOverrideModel);
  const std::vector<std::vector<std::string>> wrong = {
      {"check", "/nowhere/m.xml"},
      {"check", "/nowhere/m.xml", "--json"},
      {"check", model, "/nowhere/m.xml"},
      {"check", model, "--application", "/nowhere/m.xml"},
      {"check", directory.path()},
      {"rules", "/nowhere/m.xml"},
      {"simulate", "/nowhere/m.xml", "--trace", "/nowhere/m.xml"},
      {"simulate", model, "--trace", "/nowhere/m.xml"}};
  for (const auto& arguments : wrong) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(arguments);
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, MatchesRegex("arbiter: cannot (open|read) .+: .+\n"));
  }
}

// Of each verb that prints much, a call that does.
std::vector<std::vector<std::string>> printing(const TemporaryDirectory& directory) {
  const auto model = directory.write("m.xml", kOverrideModel);
  const auto other = directory.write("other.xml", "<behaviors/>");
  const auto trace = directory.write("t.csv", "t_ns,source\n0,/low\n");
  return {{"check", model},
          {"check", model, "--json"},
          {"check", directory.write("bad.xml", "<behaviors>\n</behaviors><x/>"), "--json"},
          {"diff", model, model},
          {"diff", model, other, "--json"},
          {"rules", model},
          {"compile", model},
          {"graph", model, "--format", "dot"},
          {"simulate", model, "--trace", trace},
          {"simulate", model, "--trace", trace, "--why"},
          {"--help"},
          {"--version"}};
}

TEST(Program, NoticesThatItsOutputCannotBeWritten) {
  const TemporaryDirectory directory;
  for (const auto& arguments : printing(directory)) {
    const auto result = arbiter(arguments, "/dev/full");
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(arguments);
    EXPECT_THAT(result.err, EndsWith("arbiter: cannot write to standard output\n"));
  }
}

// As in `arbiter rules m.xml | head -1`.
TEST(Program, EndsWithoutAWordWhereItsReaderHasGone) {
  const TemporaryDirectory directory;
  auto verbs = printing(directory);
  verbs.push_back({"compile", directory.file("m.xml"), "-o", "/dev/stdout"});
  for (auto& arguments : verbs) {
    int ends[2];
    ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
    ::close(ends[0]);
    const shm::FileDescriptor out(ends[1]);
    const std::string err = directory.write("err", "");
    const shm::FileDescriptor file(::open(err.c_str(), O_WRONLY | O_CLOEXEC));
    arguments.insert(arguments.begin(), ARBITER_PROGRAMS "/arbiter");
    ChildProcess program(arguments, {}, {-1, out.get(), file.get()});
    EXPECT_EQ(program.wait(), 128 + SIGPIPE) << testing::PrintToString(arguments);
    EXPECT_EQ(content_of(err), "") << testing::PrintToString(arguments);
  }
}

// Ten pigeons in nine holes: nothing satisfies the rule, and to find that out takes some steps.
std::string pigeons() {
  const auto sits = [](int pigeon, int hole) {
    return "/x" + std::to_string(pigeon) + '_' + std::to_string(hole);
  };
  std::string rule = "true";
  for (int pigeon = 0; pigeon < 10; ++pigeon) {
    rule += " and (false";
    for (int hole = 0; hole < 9; ++hole) rule += " or " + sits(pigeon, hole);
    rule += ")";
    for (int hole = 0; hole < 9; ++hole) {
      for (int other = 0; other < pigeon; ++other) {
        rule += " and not (" + sits(pigeon, hole) + " and " + sits(other, hole) + ")";
      }
    }
  }
  return "<behaviors><arbiter at='/p'><select from='/a'>" + rule +
         "</select></arbiter></behaviors>";
}

TEST(Program, ProvesAModelWithTheSameEffortWhateverTheVerb) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml", pigeons());
  const auto trace = directory.write("t.csv", "t_ns,source\n0,/a\n");
  const std::vector<std::vector<std::string>> verbs = {{"check", model},
                                                       {"diff", model, model},
                                                       {"simulate", model, "--trace", trace},
                                                       {"compile", model},
                                                       {"graph", model, "--format", "dot"}};
  for (auto arguments : verbs) {
    EXPECT_EQ(arbiter(arguments).exit_code, 0) << arguments[0];
    arguments.insert(arguments.end(), {"--effort", "0.001"});
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, arguments[0] == "diff" ? 2 : 1) << arguments[0];
    EXPECT_THAT(result.err, HasSubstr("allow more steps with --effort [limit-exceeded]"))
        << arguments[0];
  }
}

TEST(Program, ExitsWith2WhereANameCannotBeOne) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong = {
      {{"status", "--instance", "a/b"}, "--instance: \"a/b\" is not a name for an instance"},
      {{"pub", "Follow"}, "write \"/Follow\" for \"Follow\""},
      {{"pub", ""}, "PORT: is empty; write a port's name, such as /Arm/pos:o"},
      {{"deactivate", "Follow"}, "write \"/Follow\" for \"Follow\""}};
  for (const auto& [arguments, message] : wrong) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments.front();
    EXPECT_THAT(result.err, HasSubstr(message));
  }
  const ScopedVariable instance("ARBITER_INSTANCE", "a/b");
  for (const auto& arguments : std::vector<std::vector<std::string>>{
           {"status"}, {"pub", "/x"}, {"metrics"}, {"winners"}, {"deactivate", "/x"}}) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments.front();
    EXPECT_THAT(result.err, HasSubstr("$ARBITER_INSTANCE: \"a/b\" is not a name for an instance"));
  }
}

// Where they can be read, the verb goes on to look for its daemon.
TEST(Program, TakesMinutesWhereverItTakesATime) {
  const TemporaryDirectory directory;
  const std::vector<std::vector<std::string>> timed = {
      {"echo", "/p", "--for", "5min"},
      {"wait", "--until", "idle(/p)", "--for", "1min"},
      {"winners", "--every", "5min"},
      {"record", "--duration", "5min", "-o", directory.path() + "/r.mcap"}};
  for (auto arguments : timed) {
    arguments.insert(arguments.end(), {"--instance", "nobody-has-this-instance"});
    const auto result = arbiter(arguments);
    EXPECT_THAT(result.err, HasSubstr("no arbiterd of instance")) << arguments.front();
  }
  EXPECT_THAT(arbiter({"wait", "--until", "idle(/p)", "--timeout", "5min", "--for", "301s"}).err,
              HasSubstr("--for 301s is longer than --timeout 5min"));
  EXPECT_THAT(arbiter({"echo", "/p", "--for", "0.5min"}).err, HasSubstr("write 30s in its place"));
  EXPECT_THAT(arbiter({"echo", "/p", "--for", "0min"}).err, HasSubstr("\"0min\" is zero"));
}

// What a source's timeout may be is of no use to whoever writes an option.
TEST(Program, ATimeIsRefusedInTheWordsOfItsOption) {
  const auto problem = [](const std::vector<std::string>& arguments) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, testing::Not(HasSubstr("timeout \"")));
    EXPECT_THAT(result.err, testing::Not(HasSubstr("never be active")));
    EXPECT_THAT(result.err, testing::Not(HasSubstr("forever")));
    return result.err;
  };
  EXPECT_THAT(problem({"echo", "/p", "--for", "0s"}),
              HasSubstr("--for: \"0s\" is zero; write at least 1ns"));
  EXPECT_THAT(problem({"top", "--interval", "1h"}),
              HasSubstr("--interval: \"1h\" has an unknown unit; write 3600s in its place"));
  EXPECT_THAT(problem({"top", "--interval", "1d"}),
              HasSubstr("--interval: \"1d\" has an unknown unit; write a whole number with a unit "
                        "(ns, us, ms, s or min)"));
  EXPECT_THAT(problem({"wait", "--until", "idle(/p)", "--timeout", "0h"}),
              HasSubstr("unknown unit"));
  for (const std::string text : {"1d", "5", "min", "1smin"}) {
    EXPECT_THAT(problem({"record", "-o", "r.mcap", "--duration", text}),
                HasSubstr("(ns, us, ms, s or min)"))
        << text;
  }
}

// They are true of many good models: whoever draws or replays one did not ask for them.
TEST(Program, NotesAreToldByCheckAndNoOtherVerb) {
  TemporaryDirectory directory;
  const auto model = directory.write("m.xml",
                                     "<behaviors><source port='/a' timeout='forever'/>"
                                     "<behavior name='A'><config at='/p'>/a</config>"
                                     "<inhibition>B</inhibition></behavior>"
                                     "<behavior name='B'><config at='/q'>/b</config>"
                                     "</behavior></behaviors>");
  const auto trace = directory.write("t.csv", "t_ns,source\n0,/a\n");
  EXPECT_THAT(arbiter({"check", model}).err, HasSubstr("[forever-commands]"));
  for (const auto& arguments :
       std::vector<std::vector<std::string>>{{"diff", model, model},
                                             {"rules", model},
                                             {"simulate", model, "--trace", trace},
                                             {"compile", model},
                                             {"graph", model, "--format", "dot"}}) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 0) << arguments[0];
    EXPECT_EQ(result.err, "") << arguments[0];
  }
}

// NaN is neither below a least value nor above a most one.
TEST(Program, TakesNoNumberThatIsNone) {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"pub", "/a", "--count", "1", "--rate"},
                                             {"replay", "a.mcap", "--speed"},
                                             {"play", "a.csv", "--speed"},
                                             {"check", "a.xml", "--effort"}}) {
    for (const char* number : {"nan", "-nan", "inf", "0", "1e9", "2x", "x", ""}) {
      auto typed = arguments;
      typed.emplace_back(number);
      const auto result = arbiter(typed);
      EXPECT_EQ(result.exit_code, 2) << arguments.front() << ' ' << number;
      EXPECT_THAT(result.err, HasSubstr("is not a number from 0.001 to 1000"));
    }
  }
}

}  // namespace
}  // namespace arbiter::test
