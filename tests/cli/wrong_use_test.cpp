// What the program says of a command line that it cannot understand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/cli/arbiter_program.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Program, SuggestsTheVerbThatWasMeant) {
  const auto wrong = arbiter({"wyh", "/p"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_EQ(wrong.err, "arbiter: there is no verb \"wyh\"; did you mean \"why\"?\n");
  const auto other = arbiter({"explain", "/Arm/pos:i"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_EQ(other.err, "arbiter: there is no verb \"explain\"; did you mean \"why\"?\n");
  // By its letters it would be switch, which changes the robot.
  EXPECT_THAT(arbiter({"watch"}).err, HasSubstr("did you mean \"top\"?"));
  EXPECT_THAT(arbiter({"frobnicate"}).err, HasSubstr("`arbiter --help` lists"));
}

TEST(Program, SaysWhichArgumentItDoesNotKnowAndWhatWasMeant) {
  const auto error = [](const std::vector<std::string>& arguments) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2);
    return result.err;
  };
  EXPECT_EQ(error({"why", "/a", "--folow"}),
            "arbiter why has no option \"--folow\"; did you mean \"--follow\"?\n"
            "Run `arbiter why --help` for more information.\n");
  EXPECT_THAT(error({"recording", "winers", "x.mcap"}),
              HasSubstr("arbiter recording has no verb \"winers\"; did you mean \"winners\"?"));
  EXPECT_THAT(error({"recording"}),
              HasSubstr("arbiter recording needs a verb: info, repair, export, winners or sample"));
  EXPECT_THAT(error({"recording", "winners", "x.mcap", "--prot", "/a"}),
              HasSubstr("arbiter recording winners has no option \"--prot\"; did you mean "
                        "\"--port\"?"));
  EXPECT_THAT(error({"wait", "--util", "idle(/a)"}),
              HasSubstr("arbiter wait has no option \"--util\"; did you mean \"--until\"?"));
  EXPECT_THAT(error({"--hlep"}), HasSubstr("arbiter has no option \"--hlep\""));
  EXPECT_THAT(error({"--josn", "status"}),
              HasSubstr("arbiter status has no option \"--josn\"; did you mean \"--json\"?"));
  EXPECT_THAT(error({"recording", "--json", "info", "x.mcap"}),
              HasSubstr("go after it; write: arbiter recording info --json ..."));
  EXPECT_THAT(error({"recording", "winers", "--json", "x.mcap"}),
              HasSubstr("has no verb \"winers\"; did you mean \"winners\"?"));
  EXPECT_THAT(error({"status", "x\nforged"}), HasSubstr("for \"x\\nforged\""));
  EXPECT_THAT(error({"wait"}), HasSubstr("--until is required"));
  EXPECT_THAT(error({"pub", "/a", "one", "two"}),
              HasSubstr("arbiter pub has no place for \"one\" and \"two\""));
}

// Once for all of them, and not the option of `why` that is spelt nearly so.
TEST(Program, SaysWhichVerbHasTheOptionThatThisOneLacks) {
  const std::string said =
      "arbiter why has no option \"--recording\"; it asks a running daemon; of what was recorded, "
      "ask: arbiter simulate --recording FILE --why=PORT --at TIME\n"
      "Run `arbiter why --help` for more information.\n";
  EXPECT_EQ(arbiter({"why", "/p:i", "--recording", "inc.mcap", "--at", "3s"}).err, said);
  EXPECT_EQ(arbiter({"--recording", "why", "/p:i"}).err, said);
  EXPECT_THAT(arbiter({"why", "/p:i", "--at", "3s"}).err,
              HasSubstr("no option \"--at\"; it asks a running daemon"));
  EXPECT_THAT(arbiter({"why", "/p:i", "--at", "3s", "--folow"}).err,
              HasSubstr("TIME\narbiter why has no option \"--folow\"; did you mean"));
  EXPECT_THAT(arbiter({"why", "--help"}).out,
              HasSubstr("Of a recording: arbiter simulate --recording FILE --why=PORT --at TIME"));
}

TEST(Program, ShowsWhatWasMeantByAWordOrAnExample) {
  const auto error = [](const std::vector<std::string>& arguments) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2);
    return result.err.substr(0, result.err.find('\n'));
  };
  EXPECT_EQ(error({"wait", "idle(/a)"}), "--until is required; did you mean --until 'idle(/a)'?");
  EXPECT_EQ(error({"record", "x.mcap"}), "--output is required; did you mean --output x.mcap?");
  EXPECT_EQ(error({"simulate", "x.mcap"}), "--trace is required; did you mean --recording x.mcap?");
  EXPECT_EQ(error({"simulate", "m.xml", "t.csv"}),
            "--trace is required; did you mean --trace t.csv?");
  EXPECT_EQ(error({"wait", "not", "/a:o"}),
            "--until is required; did you mean --until 'not /a:o'?");
  EXPECT_EQ(error({"record", "/a:o"}),
            "--output is required; for example: arbiter record -o incident.mcap");
  EXPECT_THAT(error({"simulate", "t.csv"}), HasSubstr("--trace is required; for example: arbiter"));
  EXPECT_EQ(error({"switch", "a", "b"}),
            "arbiter switch has no place for \"b\"; for example: arbiter switch");
  EXPECT_EQ(error({"why"}), "PORT is required; for example: arbiter why /Gaze/pos:i");
  EXPECT_EQ(error({"reload", "m.xml"}),
            "arbiter reload has no place for \"m.xml\"; it reads the files again that arbiterd was "
            "started with; for example: arbiter reload");
  EXPECT_EQ(error({"diff", "a.xml", "b.xml", "c.xml"}),
            "arbiter diff has no place for \"c.xml\"; the files of one model are joined by commas, "
            "as in a.xml,b.xml; for example: arbiter diff search_and_track.xml new.xml");
}

TEST(Program, ShowsControlCharactersInsteadOfSendingThem) {
  for (const auto& arguments :
       std::vector<std::vector<std::string>>{{"\x1b[31mred"},
                                             {"check", "\x1b[31mred"},
                                             {"check", "m.xml", "--\x1b[31mred"},
                                             {"check", "\xc2\x9b[31mred"},
                                             {"status", "--instance", "\x1b[31mred"}}) {
    const auto result = arbiter(arguments);
    EXPECT_THAT(result.err, HasSubstr("[31mred"));
    EXPECT_THAT(result.err, Not(HasSubstr("\x1b")));
    EXPECT_THAT(result.err, Not(HasSubstr("\xc2\x9b")));
  }
}

TEST(Program, TellsTheBoundsOfNumbersShortly) {
  for (const auto& arguments : std::vector<std::vector<std::string>>{
           {"rollback", "0"}, {"echo", "/p", "--count", "0"}, {"pub", "/p", "--count", "x"}}) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("is not a whole number of at least 1\n"));
  }
}

// What a script writes where a variable is not set.
TEST(Program, RefusesWhatIsEmpty) {
  const auto error = [](const std::vector<std::string>& arguments) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments.front();
    return result.err.substr(0, result.err.find('\n'));
  };
  EXPECT_EQ(error({"metrics", "--listen", ""}),
            "--listen: is empty; write ADDRESS, or leave it out");
  EXPECT_EQ(error({"winners", "--port", ""}), "--port: is empty; write PATTERN, or leave it out");
  EXPECT_EQ(error({"stop", "--instance", ""}), "--instance: is empty; write NAME, or leave it out");
  EXPECT_EQ(error({"record", "-o", ""}), "--output: is empty; write a value");
  EXPECT_EQ(error({"switch", ""}), "NAME: is empty; write a value, or leave it out");
  EXPECT_EQ(error({"recording", "info", ""}), "FILE: is empty; write a value");
  EXPECT_EQ(error({"why", ""}), "PORT: is empty; write a port's name, such as /Arm/pos:o");
  EXPECT_EQ(error({"echo", ""}), "PORT: the name is empty; echo takes one port");
  EXPECT_EQ(error({"metrics", "--listen="}), "--listen needs a value; write: --listen ADDRESS");
  EXPECT_EQ(error({"check", "m.xml", "--silence"}),
            "--silence needs a value; write: --silence CODE");
  for (const char* option : {"--text", "--hex"}) {
    const auto result =
        arbiter({"pub", "/p", option, "", "--instance", "nobody-has-this-instance"});
    EXPECT_THAT(result.err, HasSubstr("no arbiterd of instance")) << "a sample of no bytes";
  }
}

TEST(Program, SaysInWordsWhichValuesThereAre) {
  const auto error = [](const std::vector<std::string>& arguments) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments.front();
    return result.err.substr(0, result.err.find('\n'));
  };
  EXPECT_EQ(error({"pub", "/p", "--size", "-1"}),
            "--size: \"-1\" is not a whole number from 0 to 1073741824");
  EXPECT_EQ(error({"record", "-o", "x.mcap", "--compression", "gzip"}),
            "--compression: \"gzip\" is not zstd, lz4 or none");
  EXPECT_EQ(error({"graph", "m.xml", "--view", "all"}),
            "--view: \"all\" is not auto, behaviours, connections or both");
  EXPECT_EQ(error({"winners", "--every", "1ms"}), "--every: must be at least 2ms");
  EXPECT_EQ(error({"top", "--interval", "1ms"}), "--interval: must be 20ms to 60s");
  EXPECT_EQ(error({"record", "-o", "x.mcap", "--period", "2s"}), "--period: must be 100us to 1s");
  for (const char* text : {"Inf", "forever"}) {
    EXPECT_THAT(error({"record", "-o", "x.mcap", "--period", text}), HasSubstr("; write a whole"));
  }
  EXPECT_EQ(error({"why", "In:i"}),
            "PORT: a port's name begins with '/'; write \"/In:i\" for \"In:i\"");
}

TEST(Program, SaysOfNoDaemonOnlyWhereItNeedsOne) {
  EXPECT_THAT(arbiter({"rules", "--help"}).out, Not(HasSubstr("daemon")));
  EXPECT_THAT(arbiter({"history", "--help"}).out, HasSubstr("or no daemon"));
}

TEST(Program, SaysThatOptionsGoAfterTheVerb) {
  const auto error = [](const std::vector<std::string>& arguments) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2);
    return result.err;
  };
  EXPECT_EQ(error({"--instance", "newcomer", "status"}),
            "the options of a verb go after it; write: arbiter status --instance newcomer\n"
            "Run `arbiter status --help` for more information.\n");
  EXPECT_THAT(error({"--instance", "newcomer"}),
              HasSubstr("write: arbiter VERB --instance newcomer\n"));
  EXPECT_THAT(error({"--frob", "status"}), testing::Not(HasSubstr("go after it")));
}

TEST(Program, SaysInWordsOfItsOwnWhatIsWrongWithAValue) {
  const auto error = [](const std::vector<std::string>& arguments) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments.front();
    return result.err.substr(0, result.err.find('\n'));
  };
  EXPECT_EQ(error({"status", "--json=maybe"}), "--json takes no value; leave out \"=maybe\"");
  EXPECT_EQ(error({"pub", "/p", "--rate", "1", "--rate", "2"}),
            "--rate is given 2 times; give it once");
  for (const std::string number : {"-1", "0x5", "18446744073709551616"}) {
    EXPECT_EQ(error({"recording", "sample", "x.mcap", "--source", "/a", "--sequence", number}),
              "--sequence: \"" + number + "\" is not a whole number of at least 0");
  }
  // To CLI11 it is eight.
  EXPECT_EQ(error({"rollback", "010"}), "GENERATION: \"010\" has a zero in front; write 10");
  EXPECT_EQ(error({"import", "twist_mux", "x.yaml", "--domain", "010"}),
            "--domain: \"010\" has a zero in front; write 10");
  EXPECT_EQ(error({"import", "twist_mux", "x.yaml", "--domain", "1.5"}),
            "--domain: \"1.5\" is not a whole number from 0 to 230");
  EXPECT_EQ(error({"import", "twist_mux", "x.yaml", "--idle", "stop"}),
            "--idle: \"stop\" is not auto, zero or none");
}

TEST(Program, TakesAFileBehindARepeatableOptionForWhatItIs) {
  for (const char* option : {"--port", "--source"}) {
    EXPECT_EQ(arbiter({"replay", option, "/p", "/no-such.mcap", "--speed", "2"}).err,
              "arbiter: cannot open /no-such.mcap: No such file or directory\n");
  }
}

}  // namespace
}  // namespace arbiter::test
