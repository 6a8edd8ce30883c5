// arbiter top in an emulated terminal, beside a real daemon and real ports: what is on the screen.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include <arbiter/arbiter.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/daemon.hpp"
#include "tests/top/top_program.hpp"
#include "top/keys.hpp"

namespace arbiter::test {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kUp = "\x1bOA";
const std::string kDown = "\x1bOB";
const std::string kRight = "\x1bOC";
const std::string kLeft = "\x1bOD";

// Presses `t`, and returns once it has brought that; false: in vain. On a busy machine the daemon
// may take longer to answer than the program waits for it: then it is to be asked again.
bool tap_until_shown(EmulatedTerminal& top, const std::string& text) {
  const auto is_late = [&] { return top.shows("not tapped: ") && top.shows("answer"); };
  do {
    top.type("t");
    if (!top.wait_until([&] { return !is_late(); })) return false;
    if (!top.wait_until([&] { return top.shows(text) || is_late(); })) return false;
  } while (!top.shows(text));
  return true;
}

class TopScreen : public testing::Test {
 protected:
  // The first picture that has rates: the daemon was asked twice.
  void SetUp() override {
    low_.publish(1);
    ASSERT_TRUE(top_.wait_for("/low:o")) << top_.text();
  }
  void press(const std::string& keys) const { top_.type(keys); }
  // A picture comes in pieces, its last line last. So what a key brings is there as a whole once
  // the last line is another.
  void await_last_line(const std::string& beginning) {
    ASSERT_TRUE(top_.wait_until([&] {
      return top_.row(23).substr(0, beginning.size()) == beginning;
    })) << top_.text();
  }
  void await_whole_picture() {
    press("?");
    ASSERT_NO_FATAL_FAILURE(await_last_line("Esc or q close"));
    press("\x1b");
    ASSERT_NO_FATAL_FAILURE(await_last_line("q quit"));
  }

  Daemon daemon_{kTopModel};
  Node node_{"robot"};
  InputPort<int> in_ = node_.input_port<int>("/p:i");
  OutputPort<int> low_ = node_.output_port<int>("/low:o");
  OutputPort<int> high_ = node_.output_port<int>("/high:o");
  EmulatedTerminal top_{{kArbiter, "top"}, top_environment(), {24, 80}};
};

TEST_F(TopScreen, FillsEightyColumnsAndTwentyFourRows) {
  // All of it comes in pieces.
  ASSERT_TRUE(top_.wait_until([&] {
    return top_.row(2).find("1/8") != std::string::npos && top_.shows("   none");
  })) << top_.text();
  EXPECT_THAT(top_.row(0), StartsWith("arbiter top  test  model 1"));
  EXPECT_THAT(top_.row(0), EndsWith("live"));
  EXPECT_THAT(top_.row(1), StartsWith(">INPUT PORT"));
  EXPECT_THAT(top_.row(2), StartsWith(">/p:i"));
  EXPECT_THAT(top_.row(2), HasSubstr("/low:o"));
  EXPECT_GT(top_.row_with(" /high:o"), top_.row_with("SOURCE"));
  EXPECT_GT(top_.row_with("CHANGE"), top_.row_with(" /high:o"));
  EXPECT_TRUE(top_.wait_until([&] { return top_.row(23).substr(0, 6) == "q quit"; }));
  EXPECT_TRUE(top_.is_alternate());
  EXPECT_FALSE(top_.has_cursor());
}

TEST_F(TopScreen, ShowsARateOnceTheDaemonHasCounted) {
  ASSERT_TRUE(top_.wait_until([&] {
    low_.publish(1);
    static_cast<void>(in_.take());
    const int port = top_.row_with(">/p:i");
    const int source = top_.row_with("█ active");  // …, what it publishes, what it signals
    return port != -1 &&
           std::regex_search(top_.row(port), std::regex("ms +[0-9.]+ +0 +0 +[01]/8")) &&
           source != -1 && std::regex_search(top_.row(source), std::regex("ms +[0-9.]+ +0 robot"));
  })) << top_.text();
}

TEST_F(TopScreen, EachChangeOfAWinnerScrollsBy) {
  high_.publish(1);
  ASSERT_TRUE(top_.wait_for("/low:o → /high:o")) << top_.text();
  EXPECT_THAT(top_.row(top_.row_with("/low:o → /high:o")), HasSubstr("/high:o became active"));
  ASSERT_TRUE(top_.wait_until([&] { return top_.row_with("/high:o") == 2; })) << top_.text();
  high_.deactivate();
  low_.deactivate();
  ASSERT_TRUE(top_.wait_for("→ idle")) << top_.text();
  EXPECT_LT(top_.row_with("→ idle"), top_.row_with("/low:o → /high:o"));
}

TEST_F(TopScreen, FollowsAResizeToFortyByTenAndBack) {
  top_.resize({10, 40});
  ASSERT_TRUE(top_.wait_until([&] {
    return top_.row(9).substr(0, 6) == "q quit" && top_.row(1).substr(0, 6) == ">INPUT";
  })) << top_.text();
  EXPECT_THAT(top_.row(2), HasSubstr("/low:o"));
  EXPECT_FALSE(top_.shows("SOURCE"));
  press("\t");
  EXPECT_TRUE(top_.wait_for("SOURCE")) << top_.text();
  top_.resize({24, 80});
  ASSERT_TRUE(top_.wait_until([&] { return top_.row(23).substr(0, 6) == "q quit"; }))
      << top_.text();
  EXPECT_TRUE(top_.wait_for("CHANGE"));
  for (const auto size : {EmulatedTerminal::Size{1, 1}, {2, 300}, {60, 7}, {24, 80}}) {
    top_.resize(size);  // none of them ends it
  }
  ASSERT_TRUE(top_.wait_until([&] { return top_.row(23).substr(0, 6) == "q quit"; }))
      << top_.text();
}

TEST_F(TopScreen, Filters) {
  press("/high");
  ASSERT_TRUE(top_.wait_for("filter: high_")) << top_.text();
  press("\r");
  ASSERT_TRUE(top_.wait_for("filter \"high\"")) << top_.text();
  EXPECT_TRUE(top_.wait_for_none("/p:i")) << top_.text();
  EXPECT_TRUE(top_.wait_for(" /high:o")) << top_.text();
  press("\x1b");
  ASSERT_TRUE(top_.wait_for("/p:i")) << top_.text();
}

TEST_F(TopScreen, PausesAndStepsBack) {
  high_.publish(1);
  ASSERT_TRUE(top_.wait_for("/low:o → /high:o"));
  press(" ");
  ASSERT_TRUE(top_.wait_for("PAUSED"));
  high_.deactivate();  // is not seen during the pause
  ASSERT_TRUE(top_.wait_until([&] {
    press(kLeft);
    return top_.row(2).find("/low:o") != std::string::npos;
  })) << top_.text();
  EXPECT_TRUE(top_.wait_for_none("→ /high:o")) << top_.text();
  ASSERT_TRUE(top_.wait_until([&] {
    press(kRight);
    return top_.row(2).find("/high:o") != std::string::npos;
  })) << top_.text();
  press(" ");
  ASSERT_TRUE(top_.wait_for("/high:o → /low:o")) << top_.text();
  EXPECT_TRUE(top_.wait_for("live"));
}

TEST_F(TopScreen, TellsWhyAtThePortOfTheCursor) {
  high_.publish(1);
  ASSERT_TRUE(top_.wait_for("/low:o → /high:o"));
  press("\r");
  ASSERT_TRUE(top_.wait_for("/p:i: /high:o wins")) << top_.text();
  EXPECT_TRUE(top_.wait_for("inhibited by behaviour \"High\"")) << top_.text();
  press("q");
  ASSERT_TRUE(top_.wait_for("INPUT PORT")) << top_.text();
  press("\t" + kDown + "w");  // of a source: its connections alone
  ASSERT_TRUE(top_.wait_for("/low:o is kept out")) << top_.text();
  EXPECT_TRUE(top_.wait_for_none("/high:o wins\n")) << top_.text();
}

TEST_F(TopScreen, ATapMissesNoWinnerHoweverShort) {
  ASSERT_TRUE(tap_until_shown(top_, ">t /p:i")) << top_.text();
  high_.publish(1);
  high_.deactivate();
  ASSERT_TRUE(top_.wait_until([&] {
    return top_.shows("/low:o → /high:o") && top_.shows("/high:o → /low:o");
  })) << top_.text();
  press("t");
  ASSERT_TRUE(top_.wait_for_none(">t /p:i")) << top_.text();
}

TEST_F(TopScreen, ATapTellsHowLongTheOldestSampleHasWaited) {
  top_.resize({24, 120});
  ASSERT_TRUE(tap_until_shown(top_, "OLDEST")) << top_.text();
  ASSERT_TRUE(in_.take());  // it was accepted before there was a tap
  ASSERT_TRUE(top_.wait_until([&] { return top_.row(2).find(" none") != std::string::npos; }))
      << top_.text();
  low_.publish(1);
  ASSERT_TRUE(top_.wait_until([&] {
    return std::regex_search(top_.row(2), std::regex("1/8 .* <[0-9.]+ m?s$"));
  })) << top_.text();
}

TEST_F(TopScreen, WhyOfAStepBackIsOfTheMomentShown) {
  high_.publish(1);
  ASSERT_TRUE(top_.wait_for("/low:o → /high:o")) << top_.text();
  high_.deactivate();
  ASSERT_TRUE(top_.wait_for("/high:o → /low:o")) << top_.text();
  press(" ");
  ASSERT_TRUE(top_.wait_for("PAUSED")) << top_.text();
  while (top_.row(2).find("/high:o") == std::string::npos) {
    const std::string shown = top_.row(0);  // with the time
    press(kLeft);
    ASSERT_TRUE(top_.wait_until([&] { return top_.row(0) != shown; })) << top_.text();
    ASSERT_NO_FATAL_FAILURE(await_whole_picture());
  }
  press("w");
  ASSERT_TRUE(top_.wait_for("/p:i: /high:o wins")) << top_.text();
  EXPECT_TRUE(top_.wait_for("/low:o is kept out")) << top_.text();
  EXPECT_TRUE(top_.wait_for("is of the moment shown")) << top_.text();
  press("q w");  // on again, and of now
  ASSERT_TRUE(top_.wait_for("/p:i: /low:o wins")) << top_.text();
  EXPECT_TRUE(top_.wait_for_none("is of the moment shown")) << top_.text();
}

TEST_F(TopScreen, SaysWhyASourceIsNotTapped) {
  press("\tt");
  ASSERT_TRUE(top_.wait_for("a source cannot be tapped")) << top_.text();
  press("\x1b");
  EXPECT_TRUE(top_.wait_for("q quit")) << top_.text();
}

TEST_F(TopScreen, DrawsABoundedPartOfAHugeTerminal) {
  top_.resize({320, 620});
  ASSERT_TRUE(top_.wait_until([&] { return top_.row(299).substr(0, 6) == "q quit"; }));
  top_.claim({5000, 5000});
  press("?");
  ASSERT_TRUE(top_.wait_until([&] { return top_.row(299).substr(0, 3) == "Esc"; }));
  EXPECT_EQ(top_.row(319), "");
  press("q");
  ASSERT_TRUE(top_.wait_until([&] { return top_.row(2).substr(0, 5) == ">/p:i"; }));
  top_.resize({24, 80});
  ASSERT_TRUE(top_.wait_until([&] { return top_.row(23).substr(0, 6) == "q quit"; }))
      << top_.text();
  press("q");
  EXPECT_EQ(top_.wait_for_end(), 0);
}

TEST(TopScreenOf, BeginsInATerminalOfAnySize) {
  Daemon daemon(kTopModel);
  for (const auto size : {EmulatedTerminal::Size{1, 1}, {1, 80}, {24, 1}, {2, 2}, {3, 20}}) {
    EmulatedTerminal top({kArbiter, "top"}, top_environment(), size);
    ASSERT_TRUE(top.wait_until([&] { return top.is_alternate() && !top.has_cursor(); }));
    top.type("?j\x1b\t\tt/x\rs wq");
    top.type("qq");
    EXPECT_EQ(top.wait_for_end(), 0) << size.rows << "x" << size.columns;
    EXPECT_TRUE(top.is_restored());
  }
}

TEST(TopScreenOf, NamesEachKeyInItsOptionsHelp) {
  const auto help = arbiter({"top", "--help"});
  EXPECT_EQ(help.exit_code, 0);
  for (const std::string& line : top::key_lines()) {
    EXPECT_THAT(help.out, HasSubstr("\n  " + line.substr(0, line.find("  ")) + "  ")) << help.out;
  }
}

TEST(TopScreenOf, LongNamesAndTheMarkOfATapAreSeenInEightyColumns) {
  const std::string local = "/Navigation/local_planner/cmd_vel:o";
  const std::string global = "/Navigation/global_planner/cmd_vel:o";
  Daemon daemon(
      "<behaviors timeout=\"forever\"><behavior name=\"A\"><config "
      "at=\"/Locomotion/base_controller/cmd_vel:i\">" +
      local +
      "</config></behavior><behavior name=\"B\"><config "
      "at=\"/Locomotion/base_controller/cmd_vel:i\">" +
      global + "</config><inhibition>A</inhibition></behavior></behaviors>");
  Node node("robot");
  auto in = node.input_port<int>("/Locomotion/base_controller/cmd_vel:i");
  auto out = node.output_port<int>(local);
  auto other = node.output_port<int>(global);
  EmulatedTerminal top({kArbiter, "top"}, top_environment({{"TERM", "vt100"}}), {24, 80});
  out.publish(1);
  ASSERT_TRUE(top.wait_for("/loc")) << top.text();
  ASSERT_TRUE(tap_until_shown(top, ">t /Loc")) << top.text();
  other.publish(1);
  const auto port = [&] { return top.row(top.row_with(">t /Loc")); };
  ASSERT_TRUE(top.wait_until([&] { return port().find("/glo") != std::string::npos; }))
      << top.text();
  EXPECT_THAT(port(), HasSubstr("cmd_vel:i "));
  EXPECT_THAT(port(), HasSubstr("cmd_vel:o "));
}

TEST(TopScreenOf, SaysThatThePolicyForbidsATap) {
  TemporaryDirectory files;
  const std::string policy = files.write("policy", "deny everyone tap /p:i\nallow everyone all\n");
  Daemon daemon(kTopModel, {.arguments = {"--policy", policy}});
  EmulatedTerminal top({kArbiter, "top"}, top_environment(), {24, 120});
  ASSERT_TRUE(top.wait_for("/p:i")) << top.text();
  ASSERT_TRUE(tap_until_shown(top, "may not tap the port /p:i")) << top.text();
  EXPECT_TRUE(top.shows("not tapped: ")) << top.text();
  // It is not taken for tapped: the next press asks again.
  files.write("policy", "allow everyone all\n");
  ASSERT_EQ(arbiter({"reload"}).exit_code, 0);
  EXPECT_TRUE(tap_until_shown(top, ">t /p:i")) << top.text();
}

// However long the interval: what somebody waits for is drawn when it comes.
TEST(TopScreenOf, DrawsTheFirstPictureAndTheFirstRatesAtOnce) {
  Daemon daemon(kTopModel);
  Node node("robot");
  auto low = node.output_port<int>("/low:o");
  EmulatedTerminal top({kArbiter, "top", "--interval", "60s"}, top_environment(), {24, 80});
  EXPECT_TRUE(top.wait_for("/low:o")) << top.text();
  EXPECT_TRUE(top.wait_until([&] {
    const int source = top.row_with(" /low:o");
    return source != -1 && std::regex_search(top.row(source), std::regex("never +forever +0 +0 "));
  })) << top.text();
}

TEST_F(TopScreen, SortsByTheNextColumn) {
  press("\tr");
  ASSERT_TRUE(top_.wait_until([&] {
    return top_.row_with(">/low:o") != -1 && top_.row_with(">/low:o") < top_.row_with(" /high:o");
  })) << top_.text();
  press("s");
  ASSERT_TRUE(top_.wait_for("ACTIVITY▾")) << top_.text();
}

// Its title said "live", and the counts were gone without a word.
TEST_F(TopScreen, SaysThatTheDaemonDoesNotAnswerAndWhatToDo) {
  daemon_.process().stop();
  ASSERT_TRUE(top_.wait_for("NO ANSWER from the daemon")) << top_.text();
  ASSERT_TRUE(top_.wait_for("run: kill -CONT ")) << top_.text();
  daemon_.process().resume();
  ASSERT_TRUE(top_.wait_for("  live")) << top_.text();
}

TEST_F(TopScreen, GoesOnWithoutADaemonAndWithTheNext) {
  daemon_.kill();
  ASSERT_TRUE(top_.wait_for("NO DAEMON")) << top_.text();
  high_.publish(1);  // decisions go on
  ASSERT_TRUE(top_.wait_for("/low:o → /high:o")) << top_.text();
  // What it had counted does not stay on the screen as if it were still so.
  ASSERT_TRUE(top_.wait_until([&] {
    return std::regex_search(top_.row(2), std::regex("s +\\? +\\? +\\? +\\? "));
  })) << top_.text();
  daemon_.restart();
  ASSERT_TRUE(top_.wait_until([&] { return top_.row(0).find("live") != std::string::npos; }))
      << top_.text();
  OutputPort<int> late = node_.output_port<int>("/late:o");
  ASSERT_TRUE(top_.wait_for("/late:o")) << top_.text();  // what the new one counts
}

TEST_F(TopScreen, AStoppedDaemonStopsNeitherTheScreenNorTheKeys) {
  daemon_.process().stop();
  high_.publish(1);
  ASSERT_TRUE(top_.wait_for("/low:o → /high:o")) << top_.text();
  press("?");
  ASSERT_TRUE(top_.wait_for("Keys and columns")) << top_.text();
  press("qq");
  EXPECT_EQ(top_.wait_for_end(), 0);
  daemon_.process().resume();
}

}  // namespace
}  // namespace arbiter::test
