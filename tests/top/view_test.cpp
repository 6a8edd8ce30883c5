// The view without a terminal: pictures and keys go in, lines come out.
#include "top/view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <clocale>

#include "tests/support/text_files.hpp"
#include "tests/top/pictures.hpp"

namespace arbiter::top {
namespace {

using testing::HasSubstr;
using testing::Not;

class TopView : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_NE(std::setlocale(LC_CTYPE, "C.UTF-8"), nullptr);
    view_.add(shared(frame_at(10)), {});
  }

  std::string screen(Size size = {80, 24}) {
    std::string text;
    for (const Line& line : view_.draw(size)) text += line.text() + "\n";
    return text;
  }
  // The line that has this text in it.
  std::string line_with(const std::string& text, Size size = {80, 24}) {
    for (const Line& line : view_.draw(size)) {
      if (line.text().find(text) != std::string::npos) return line.text();
    }
    return "";
  }
  std::string selected(Size size = {80, 24}) {
    for (const Line& line : view_.draw(size)) {
      if (line.is_selected) return line.text();
    }
    return "";
  }
  std::optional<WhyQuestion> press(Key key) { return view_.press({key, ""}); }
  std::optional<WhyQuestion> press(const std::string& character) {
    return view_.press({Key::kCharacter, character});
  }
  void type(const std::string& text) {
    for (const char each : text) press(std::string(1, each));
  }

  View view_{Charset::kUtf8, 100};
};

TEST_F(TopView, ShowsWhoWinsSinceWhenAndHowMuchComes) {
  EXPECT_EQ(line_with("/arm:i"),
            ">/arm:i      /object:o   3.0 s 100 ms   30.0     -    60.0     1/4 arm (pid 7)");
  EXPECT_EQ(line_with("/gaze:i"),
            " /gaze:i     idle       >1.0 s      -   10.0   2.0       -     1/4 arm (pid 7)");
}

TEST_F(TopView, ShowsABarThatFadesUntilTheActivityEnds) {
  EXPECT_THAT(line_with(" /object:o "), HasSubstr("/object:o"));
  press(Key::kTab);
  EXPECT_THAT(line_with("/object:o ████"), HasSubstr("████████   active  500 ms 100 ms"));
  EXPECT_THAT(line_with("/face:o"), HasSubstr("silent  500 ms  1.5 s"));
  EXPECT_THAT(line_with("/rest:o"), HasSubstr("never   500 ms      -"));
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
  EXPECT_THAT(screen(), HasSubstr("PAUSED, 0 ms before"));
  view_.add(shared(frame_at(16)), {});
  press(Key::kLeft);
  EXPECT_THAT(screen(), HasSubstr("PAUSED, 3.0 s before"));
  press("[");
  EXPECT_THAT(screen(), HasSubstr("PAUSED, 5.0 s before"));
  press(Key::kRight);
  EXPECT_THAT(screen(), HasSubstr("PAUSED, 3.0 s before"));
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

TEST_F(TopView, AsksWhyOfWhatTheCursorIsOn) {
  auto question = press(Key::kEnter);
  ASSERT_TRUE(question);
  EXPECT_EQ(question->ports, std::vector<std::string>{"/arm:i"});
  EXPECT_THAT(screen(), HasSubstr("asking"));
  view_.set_answer({*question, {"/arm:i: /object:o wins"}});
  EXPECT_THAT(screen(), HasSubstr("/arm:i: /object:o wins"));
  press("q");  // closes it, and leaves only then
  EXPECT_FALSE(view_.is_over());
  EXPECT_THAT(screen(), HasSubstr("INPUT PORT"));
  view_.set_answer({*question, {"too late"}});
  EXPECT_THAT(screen(), Not(HasSubstr("too late")));

  press(Key::kTab);
  question = press("w");
  ASSERT_TRUE(question);
  EXPECT_EQ(question->source, "/face:o");
  EXPECT_EQ(question->ports, std::vector<std::string>{"/arm:i"});
}

TEST_F(TopView, TapsThePortOfTheCursorUntilItIsAskedAgain) {
  press("t");
  EXPECT_EQ(view_.tapped(), std::set<std::string>{"/arm:i"});
  press(Key::kDown);
  press("t");
  EXPECT_EQ(view_.tapped(), (std::set<std::string>{"/arm:i", "/gaze:i"}));
  press("t");
  EXPECT_EQ(view_.tapped(), std::set<std::string>{"/arm:i"});
  Frame frame = frame_at(11);
  frame.ports[0].is_tapped = true;
  view_.add(shared(frame), {});
  EXPECT_THAT(screen(), HasSubstr("/arm:i (t)"));
  EXPECT_THAT(screen(), HasSubstr("OLDEST"));
  EXPECT_EQ(line_with("/arm:i").back(), '-');
  frame.ports[0].oldest = kSecond / 25;
  view_.add(shared(frame), {});
  EXPECT_THAT(line_with("/arm:i"), testing::EndsWith("<40 ms"));
  frame.ports[0].waits = top::Waits{640, 1'600};
  view_.add(shared(frame), {});
  EXPECT_THAT(screen({120, 24}), HasSubstr("640 ns"));
  EXPECT_THAT(screen({120, 24}), HasSubstr("1.6 us"));
  for (int i = 0; i < 11; ++i) press("s");
  EXPECT_THAT(screen({120, 24}), HasSubstr("OLDEST▾"));
  view_.add(shared(frame_at(12)), {});
  EXPECT_THAT(screen({120, 24}), HasSubstr("COMPONENT▾"));  // that column has gone
}

TEST_F(TopView, ALongExplanationScrolls) {
  const auto question = press(Key::kEnter);
  std::vector<std::string> lines;
  for (int i = 1; i <= 50; ++i) lines.push_back("line " + std::to_string(i));
  view_.set_answer({*question, lines});
  EXPECT_THAT(screen({80, 12}), HasSubstr("line 9\n"));
  EXPECT_THAT(screen({80, 12}), Not(HasSubstr("line 10\n")));
  press(Key::kDown);
  EXPECT_THAT(screen({80, 12}), HasSubstr("line 10\n"));
  press(Key::kEnd);
  EXPECT_THAT(screen({80, 12}), HasSubstr("line 50\n"));
}

TEST_F(TopView, TheHelpNamesEachKey) {
  press("?");
  const std::string help = screen({80, 40});
  for (const char* key : {"q ", "j k", "Tab", "Enter w", "/ ", "s  r", "Space p", "[ ]"}) {
    EXPECT_THAT(help, HasSubstr(key));
  }
  press(Key::kEscape);
  EXPECT_THAT(screen(), HasSubstr("INPUT PORT"));
}

TEST_F(TopView, ThePageNamesEachColumn) {
  const std::string page = test::content_of(std::string(ARBITER_TEST_DATA) + "/../../docs/top.md");
  const Frame frame = frame_at(10);
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
