// The view without a terminal: pictures and keys go in, lines come out.
#include "top/view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <sstream>

#include "tests/support/text_files.hpp"
#include "tests/top/view_fixture.hpp"

namespace arbiter::top {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST_F(TopView, ShowsWhoWinsSinceWhenAndHowMuchComes) {
  EXPECT_EQ(line_with("/arm:i"),
            ">/arm:i      /object:o   3.0 s 100 ms   30.0     0    60.0     1/4 arm (pid 7)");
  EXPECT_EQ(line_with("/gaze:i"),
            " /gaze:i     idle       >1.0 s          10.0   2.0       0     1/4 arm (pid 7)");
}

TEST_F(TopView, ShowsABarThatFadesUntilTheActivityEnds) {
  EXPECT_THAT(line_with(" /object:o "), HasSubstr("/object:o"));
  press(Key::kTab);
  EXPECT_THAT(line_with("/object:o ████"), HasSubstr("████████   active  500 ms 100 ms"));
  EXPECT_THAT(line_with("/face:o"), HasSubstr("silent  500 ms  1.5 s"));
  EXPECT_THAT(line_with("/rest:o"), HasSubstr("never   500 ms          20.0"));
}

// 0 is 0; "?" is not known; nothing stands where there is nothing to tell.
TEST_F(TopView, TellsNoneFromNotKnownFromNothingToTell) {
  Census census = census_of_robot();
  census.ports[0].rates = PortRates{0, 0, 0};
  census.ports[1].rates.reset();  // open, and not counted yet
  PortFact closed;
  closed.name = "/closed:i";
  closed.component = "not open";
  census.ports.insert(census.ports.begin() + 1, closed);
  census.sources[0].rates.reset();
  census.sources[1].is_open = false;
  census.sources[1].rates.reset();
  Frame frame = frame_at(11, std::make_shared<const Census>(census));
  frame.ports.insert(frame.ports.begin() + 1, PortState{});
  view_.add(shared(frame), {});
  EXPECT_THAT(line_with("/arm:i"), HasSubstr(" 0     0       0     1/4 arm"));
  EXPECT_THAT(line_with("/gaze:i"), HasSubstr(" ?     ?       ?     1/4 arm"));
  EXPECT_THAT(line_with("/closed:i"),
              testing::ContainsRegex("/closed:i +\\? +\\? +\\? +not open$"));
  EXPECT_THAT(line_with("/face:o"), testing::ContainsRegex(" s +\\? +\\? source .pid 8.$"));
  EXPECT_THAT(line_with("/object:o █"), testing::ContainsRegex(" ms +100 ms +source .pid 8.$"));
}

TEST_F(TopView, EachLineIsAsWideAsTheScreen) {
  for (std::size_t columns = 1; columns <= 140; ++columns) {
    for (std::size_t rows = 1; rows <= 30; ++rows) {
      const auto lines = view_.draw({columns, rows});
      ASSERT_EQ(lines.size(), rows) << columns << "x" << rows;
      for (const Line& line : lines) {
        std::size_t width = 0;
        for (const Span& span : line.spans) width += columns_of(span.text);
        ASSERT_TRUE(width == columns || columns < 24) << line.text();
      }
    }
  }
}

TEST_F(TopView, ShowsOnePaneWhereThereIsNoRoomForAll) {
  EXPECT_THAT(screen({40, 10}), HasSubstr("INPUT PORT"));
  EXPECT_THAT(screen({40, 10}), Not(HasSubstr("SOURCE")));
  press(Key::kTab);
  EXPECT_THAT(screen({40, 10}), Not(HasSubstr("INPUT PORT")));
  EXPECT_THAT(screen({40, 10}), HasSubstr("SOURCE"));
  press(Key::kBackTab);
  EXPECT_THAT(screen({40, 10}), HasSubstr("INPUT PORT"));
}

TEST_F(TopView, LeavesOutColumnsWhereTheScreenIsNarrow) {
  EXPECT_THAT(screen({80, 24}), HasSubstr("LOSERS"));
  EXPECT_THAT(screen({40, 24}), Not(HasSubstr("LOSERS")));
  EXPECT_THAT(line_with("/arm:i", {40, 24}), HasSubstr("/object:o"));
}

TEST_F(TopView, TheCursorStaysOnItsRowWhenTheOrderChanges) {
  press(Key::kDown);
  EXPECT_THAT(selected(), HasSubstr("/gaze:i"));
  press("r");
  EXPECT_THAT(selected(), HasSubstr("/gaze:i"));
  EXPECT_LT(screen().find("/gaze:i"), screen().find("/arm:i"));
}

TEST_F(TopView, SortsByEachColumnTheLargestNumbersFirst) {
  for (int i = 0; i < 4; ++i) press("s");  // WINNER, SINCE, LAST, TAKEN
  EXPECT_THAT(screen(), HasSubstr("TAKEN▾"));
  EXPECT_LT(screen().find("/arm:i"), screen().find("/gaze:i"));
  press("r");
  EXPECT_THAT(screen(), HasSubstr("TAKEN▴"));
  EXPECT_GT(screen().find("/arm:i"), screen().find("/gaze:i"));
}

TEST_F(TopView, FiltersByAnyNameOfARow) {
  press("/");
  type("OBJq");
  EXPECT_THAT(screen(), HasSubstr("filter: OBJq_"));  // a letter, not a command
  EXPECT_FALSE(view_.is_over());
  press(Key::kBackspace);
  press(Key::kEnter);
  EXPECT_THAT(screen(), HasSubstr("/arm:i"));  // its winner has it
  EXPECT_THAT(screen(), Not(HasSubstr("/gaze:i")));
  EXPECT_THAT(screen(), Not(HasSubstr("/face:o")));
  EXPECT_THAT(screen(), HasSubstr("filter \"OBJ\""));
  press(Key::kEscape);
  EXPECT_THAT(screen(), HasSubstr("/gaze:i"));
}

TEST_F(TopView, PausesAndStepsBackAndForward) {
  view_.add(shared(frame_at(12)), {});
  view_.add(shared(frame_at(15)), {});
  press(" ");
  EXPECT_THAT(screen(), HasSubstr("PAUSED\n"));
  view_.add(shared(frame_at(16)), {});
  press(Key::kLeft);
  EXPECT_THAT(screen(), HasSubstr("PAUSED, 3.0 s back"));
  press("[");
  EXPECT_THAT(screen(), HasSubstr("PAUSED, 5.0 s back"));
  press("[");
  EXPECT_THAT(screen(), HasSubstr("no older picture is kept"));
  press(Key::kRight);
  EXPECT_THAT(screen(), Not(HasSubstr("no older")));
  EXPECT_THAT(screen(), HasSubstr("PAUSED, 3.0 s back"));
  press(" ");
  EXPECT_THAT(screen(), Not(HasSubstr("PAUSED")));
}

TEST_F(TopView, ChangesScrollByTheNewestFirst) {
  Frame frame = frame_at(11);
  frame.takeovers = 2;
  view_.add(shared(frame), {takeover(1, "/face:o"), takeover(2, "")});
  EXPECT_THAT(screen(), HasSubstr("idle → /face:o"));
  EXPECT_LT(screen().find("idle → idle"), screen().find("idle → /face:o"));
  press(Key::kBackTab);
  EXPECT_THAT(selected(), HasSubstr("idle → idle"));
  press(Key::kDown);
  frame.takeovers = 3;
  view_.add(shared(frame), {takeover(3, "/rest:o")});
  EXPECT_THAT(selected(), HasSubstr("/face:o"));  // the cursor stays on its row
  press(Key::kHome);
  frame.takeovers = 4;
  view_.add(shared(frame), {takeover(4, "/object:o")});
  EXPECT_THAT(selected(), HasSubstr("/object:o"));  // and at the newest
}

TEST_F(TopView, WhatADaemonThatIsGoneHadCountedIsNotToldAsIfItWereNow) {
  Frame frame = frame_at(11);
  frame.is_counted = false;
  view_.add(shared(frame), {});
  EXPECT_THAT(line_with("/arm:i"), testing::ContainsRegex("100 ms +\\? +\\? +\\? +\\? arm"));
  EXPECT_THAT(line_with("/face:o"), testing::ContainsRegex(" s +\\? +\\? source"));
}

// Nor may columns come and go while winners change.
TEST_F(TopView, ColumnsDoNotDependOnWhoWins) {
  Census census = census_of_robot();
  census.sources[1].name = "/object/of/some/interest/nearby:o";
  Frame frame = frame_at(11, std::make_shared<const Census>(census));
  view_.add(shared(frame), {});
  const std::string header = line_with("INPUT PORT");
  frame.ports[0].winner = kNobody;
  view_.add(shared(frame), {});
  EXPECT_EQ(line_with("INPUT PORT"), header);
}

// As a robot's ports are called: longer than their columns.
TEST_F(TopView, LongNamesCanBeToldApartInEightyColumns) {
  const std::vector<std::string> names = {
      "/Navigation/global_planner/cmd_vel:o", "/Navigation/global_planner/path:o",
      "/Navigation/local_planner/cmd_vel:o",  "/Navigation/local_planner/path:o",
      "/Perception/camera_left/image:o",      "/Perception/camera_right/image:o"};
  Census census = census_of_robot();
  Frame frame = frame_at(11);
  const SourceFact source = census.sources[0];
  const PortFact port = census.ports[0];
  census.sources.clear();
  census.ports.clear();
  frame.ports.clear();
  frame.words.clear();
  for (std::size_t i = 0; i < names.size(); ++i) {
    census.sources.push_back(source);
    census.sources.back().name = names[i];
    frame.words.push_back(frame.now + kSecond);
    census.ports.push_back(port);
    census.ports.back().name = names[i].substr(0, names[i].size() - 1) + "i";
    frame.ports.push_back({static_cast<std::int32_t>(i), frame.now - kSecond, true, true});
  }
  frame.census = std::make_shared<const Census>(census);
  frame.takeovers = 1;
  Takeover change = takeover(1, names[2]);
  change.before = names[0];
  change.port = census.ports[2].name;
  view_.add(shared(frame), {change});
  std::set<std::string> ports;
  std::set<std::string> winners;
  std::set<std::string> sources;
  for (const Line& line : view_.draw({80, 30})) {
    const std::string text = line.text();
    if (text.substr(0, 4) == " t /" || text.substr(0, 4) == ">t /") {
      std::istringstream in(text.substr(2));
      std::string name, winner;
      in >> name >> winner;
      ports.insert(name);
      winners.insert(winner);
    } else if (text.find(" active ") != std::string::npos) {
      sources.insert(text.substr(1, text.find(' ', 1) - 1));
    }
  }
  EXPECT_EQ(ports.size(), names.size()) << screen({80, 30});
  EXPECT_EQ(winners.size(), names.size()) << screen({80, 30});
  EXPECT_EQ(sources.size(), names.size()) << screen({80, 30});
  const std::string text = line_with(" → ", {80, 30});
  EXPECT_THAT(text, testing::EndsWith("became active"));
  EXPECT_THAT(text, HasSubstr("…"));
  EXPECT_THAT(screen({200, 30}), HasSubstr(names[2] + " became active"));
}

TEST_F(TopView, MarksASourceWhosePublisherIsSlowerThanItsT) {
  Frame frame = frame_at(10);
  frame.slow_periods = {0, kSecond * 3 / 4, 0};
  view_.add(shared(frame), {});
  EXPECT_THAT(line_with("/object:o █"), HasSubstr("active !500 ms"));
  EXPECT_THAT(line_with("/face:o"), HasSubstr("silent  500 ms"));
  press(Key::kTab);
  press(Key::kDown);
  const auto question = press(Key::kEnter);
  ASSERT_TRUE(question);
  EXPECT_THAT(question->seen,
              testing::Contains("  ! /object:o publishes every 750 ms, and its T is "
                                "500 ms: it is inactive in between"));
}

// The mark of a tapped port is not part of what is sorted by.
TEST_F(TopView, ATapChangesNoOrder) {
  Census census = census_of_robot();
  census.ports[1].name = "/arm:i !";  // "/arm:i (t)" would stand behind it
  Frame frame = frame_at(11, std::make_shared<const Census>(census));
  frame.ports[0].is_tapped = true;
  view_.add(shared(frame), {});
  EXPECT_LT(screen().find("t /arm:i "), screen().find("   /arm:i !"));
  frame.ports[0].is_tapped = false;
  frame.ports[1].is_tapped = true;
  view_.add(shared(frame), {});
  EXPECT_LT(screen().find("/arm:i "), screen().find("t /arm:i !"));
}

TEST_F(TopView, SortsByNoColumnThatIsNotShown) {
  screen({40, 24});
  for (int i = 0; i < 4; ++i) {
    press("s");
    EXPECT_THAT(line_with("INPUT PORT", {40, 24}), testing::ContainsRegex("▴|▾")) << i;
  }
}

TEST_F(TopView, ShowsFromWhichHostASourceComesWhereOneDoes) {
  press(Key::kTab);
  EXPECT_THAT(screen(), Not(HasSubstr("HOST")));
  Census census = census_of_robot();
  census.sources[0].host = "head";
  view_.add(shared(frame_at(11, std::make_shared<const Census>(census))), {});
  EXPECT_THAT(screen(), HasSubstr("HOST"));
  EXPECT_THAT(line_with(census.sources[0].name), HasSubstr(" head"));
}

TEST_F(TopView, ThePageNamesEachColumn) {
  const std::string page = test::content_of(std::string(ARBITER_TEST_DATA) + "/../../docs/top.md");
  Census census = census_of_robot();
  census.sources[0].host = "head";
  const Frame frame = frame_at(10, std::make_shared<const Census>(census));
  for (const Table& table :
       {ports_table(frame, "", Charset::kUtf8), sources_table(frame, "", Charset::kUtf8)}) {
    for (std::size_t i = 1; i < table.columns.size(); ++i) {
      const std::string& title = table.columns[i].title;
      EXPECT_TRUE(title.empty() || page.find("`" + title + "`") != std::string::npos) << title;
    }
  }
}

TEST_F(TopView, SaysThatThereIsNoDaemonAndThatItCannotAsk) {
  view_.set_problem("arbiterd does not let you observe");
  EXPECT_THAT(screen(), HasSubstr("does not let you observe"));
  Frame frame = frame_at(11);
  frame.has_daemon = false;
  view_.add(shared(frame), {});
  EXPECT_THAT(screen(), HasSubstr("NO DAEMON"));
}

// They may command somebody who is idle here.
TEST_F(TopView, SaysThatThereAreComponentsThatTheDaemonDoesNotKnow) {
  Census census = census_of_robot();
  census.strangers = 2;
  view_.add(shared(frame_at(11, std::make_shared<const Census>(census))), {});
  EXPECT_THAT(view_.draw({80, 24})[0].text(),
              testing::EndsWith("  2 components unknown: see arbiter status"));
}

// What to do about it comes last, so a problem gets the lines that it needs.
TEST_F(TopView, BreaksAProblemThatIsWiderThanTheScreen) {
  view_.set_problem("not tapped: user 1000 may not tap the port /" + std::string(50, 'p') +
                    "; see line 3 of the policy");
  for (const std::size_t rows : {2u, 8u, 24u}) {
    EXPECT_EQ(view_.draw({80, rows}).size(), rows);
    for (const Line& line : view_.draw({80, rows})) EXPECT_LE(columns_of(line.text()), 80u);
  }
  auto lines = view_.draw({80, 24});
  EXPECT_THAT(lines[22].text(), HasSubstr("not tapped: user 1000"));
  EXPECT_THAT(lines[23].text(), HasSubstr("line 3 of the policy"));
  view_.set_problem(std::string(10'000, 'x'));
  lines = view_.draw({80, 24});
  EXPECT_THAT(lines[17].text(), testing::Not(HasSubstr("xxx")));
  EXPECT_THAT(lines[18].text(), HasSubstr("xxx"));
  EXPECT_THAT(lines[23].text(), HasSubstr("xxx…"));
  EXPECT_THAT(screen(), HasSubstr("CHANGE"));
}

TEST_F(TopView, SaysThatAWinnerCannotDeliver) {
  Census census = census_of_robot();
  census.ports[0].useless = "/object:o";
  view_.add(shared(frame_at(11, std::make_shared<const Census>(census))), {});
  EXPECT_THAT(line_with("/arm:i"), HasSubstr("! /object:o"));
}

TEST_F(TopView, HostileNamesTakeTheirColumnsAndNoMore) {
  Census census = census_of_robot();
  census.ports[0].name = "/arm\x1b[31m:i";
  census.ports[1].name = "/腕腕腕腕腕腕腕腕腕腕腕腕腕腕腕腕腕腕腕腕:i";
  view_.add(shared(frame_at(11, std::make_shared<const Census>(census))), {});
  const std::string text = screen();
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_THAT(text, HasSubstr("/arm\\x1b"));
  for (const Line& line : view_.draw({80, 24})) {
    std::size_t width = 0;
    for (const Span& span : line.spans) width += columns_of(span.text);
    EXPECT_EQ(width, 80u) << line.text();
  }
}

TEST_F(TopView, ManyPortsScrollAndSayWhichAreShown) {
  Census census = census_of_robot();
  Frame frame = frame_at(11);
  for (int i = 0; i < 40; ++i) {
    census.ports.push_back(census.ports[0]);
    census.ports.back().name = "/z" + std::to_string(10 + i) + ":i";
    frame.ports.push_back(frame.ports[0]);
  }
  frame.census = std::make_shared<const Census>(census);
  view_.add(shared(frame), {});
  EXPECT_THAT(screen(), HasSubstr("INPUT PORT"));
  EXPECT_THAT(screen({120, 24}), HasSubstr("/42"));
  press(Key::kEnd);
  EXPECT_THAT(selected({120, 24}), HasSubstr("/z49:i"));
  EXPECT_THAT(screen({120, 24}), HasSubstr("-42/42"));
}

TEST_F(TopView, AllOfItAsTextIsNotCut) {
  const std::string text = view_.text();
  EXPECT_THAT(text, HasSubstr("instance robot, model 1"));
  EXPECT_THAT(text, HasSubstr("arm (pid 7)"));
  EXPECT_THAT(text, HasSubstr("/rest:o"));
}

}  // namespace
}  // namespace arbiter::top
