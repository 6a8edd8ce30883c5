// The view without a terminal: pictures and keys go in, lines come out.
#include "top/view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <clocale>
#include <iterator>
#include <set>
#include <sstream>

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

TEST_F(TopView, AsksWhyOfWhatTheCursorIsOn) {
  auto question = press(Key::kEnter);
  ASSERT_TRUE(question);
  EXPECT_EQ(question->ports, std::vector<std::string>{"/arm:i"});
  EXPECT_THAT(screen(), HasSubstr("asking"));
  view_.set_answer({*question, {"/arm:i: /object:o wins"}});
  EXPECT_THAT(screen(), HasSubstr("/arm:i: /object:o wins"));
  // Which may be more than the rules can tell.
  EXPECT_THAT(screen(), HasSubstr("\n  /arm:i: /object:o has won for 3.0 s\n"));
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
  EXPECT_THAT(screen(), HasSubstr("\n t /arm:i"));
  EXPECT_THAT(screen(), HasSubstr("\n>  /gaze:i"));
  EXPECT_THAT(screen(), HasSubstr("OLDEST"));
  EXPECT_THAT(line_with("/arm:i"), testing::EndsWith("none       ?"));
  EXPECT_THAT(line_with("/gaze:i"), testing::EndsWith(" 1/4"));
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

std::set<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), std::istream_iterator<std::string>()};
}

std::set<std::string> helped_keys() {
  std::set<std::string> keys;
  for (const std::string& line : key_lines()) keys.merge(words_of(line.substr(0, line.find("  "))));
  return keys;
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

TEST_F(TopView, TheHelpNamesEachKeyThatDoesSomething) {
  const std::set<std::string> keys = helped_keys();
  for (const Binding& each : bindings()) {
    EXPECT_EQ(keys.count(each.label), 1u) << each.label;
    EXPECT_EQ(command_of(each.press), each.command) << each.label;
  }
  // What is not bound is the terminal's.
  EXPECT_EQ(keys.size(), bindings().size() + 2);  // Ctrl-C, Ctrl-L
  press("?");
  const std::string help = screen({80, 60});
  for (const std::string& key : keys) EXPECT_THAT(help, HasSubstr(key));
  press(Key::kEscape);
  EXPECT_THAT(screen(), HasSubstr("INPUT PORT"));
}

TEST_F(TopView, ThePageNamesTheKeysThatTheHelpNames) {
  const std::string page = test::content_of(std::string(ARBITER_TEST_DATA) + "/../../docs/top.md");
  std::istringstream section(page.substr(page.find("## Keys")));
  std::set<std::string> keys;
  for (std::string line; std::getline(section, line) && line.rfind("## What", 0) != 0;) {
    if (line.rfind("| `", 0) != 0) continue;
    std::string cell = line.substr(2, line.find(" |") - 2);
    for (char& each : cell) each = each == '`' || each == ',' ? ' ' : each;
    keys.merge(words_of(cell));
  }
  EXPECT_EQ(keys, helped_keys());
}

// A term in front, and below each other what it means, also where the screen is narrow.
TEST_F(TopView, TheHelpStandsInTwoColumnsHoweverWideTheScreen) {
  press("?");
  for (const std::size_t columns : {60u, 80u, 120u}) {
    const auto lines = view_.draw({columns, 80});
    for (std::size_t i = 2; i + 1 < lines.size(); ++i) {
      const std::string line = lines[i].text();
      if (line.rfind("Rates", 0) == 0) break;
      if (line.empty()) continue;
      ASSERT_GT(line.size(), 17u) << columns << ": " << line;
      EXPECT_EQ(line[16], ' ') << columns << ": " << line;
      EXPECT_NE(line[17], ' ') << columns << ": " << line;
    }
  }
}

TEST_F(TopView, SaysWhyAKeyDoesNothing) {
  press("x");
  EXPECT_THAT(screen(), HasSubstr("does nothing here; ? shows the keys"));
  press(Key::kTab);
  EXPECT_THAT(screen(), Not(HasSubstr("does nothing")));
  press("t");
  EXPECT_THAT(screen(), HasSubstr("a source cannot be tapped, input ports can: Tab goes to them"));
  EXPECT_TRUE(view_.tapped().empty());
  press(Key::kTab);
  press("t");
  EXPECT_THAT(screen(), HasSubstr("no port here to tap"));
  press(Key::kEnter);
  EXPECT_THAT(screen(), HasSubstr("nothing here to ask about"));
  press("s");
  EXPECT_THAT(screen(), HasSubstr("newest first"));
  press("r");
  EXPECT_THAT(screen(), HasSubstr("newest first"));
  press(Key::kTab);
  press(" ");
  press("t");
  EXPECT_THAT(screen(), HasSubstr("from now on tapped: /arm:i; to be seen once you go on"));
  // What is new is more important.
  view_.set_problem("arbiterd does not let you observe");
  press(" ");
  EXPECT_THAT(screen(), HasSubstr("does not let you observe"));
}

TEST_F(TopView, WhySpeaksOfTheMomentShown) {
  auto question = press(Key::kEnter);
  EXPECT_EQ(question->moment, nullptr);
  EXPECT_THAT(screen(), HasSubstr("Why /arm:i, now"));
  press(Key::kEscape);
  Frame eleven = frame_at(11);
  eleven.takeovers = 1;
  const auto then = shared(eleven);
  view_.add(then, {takeover(1, "/object:o")});
  view_.add(shared(frame_at(12)), {});
  press(Key::kLeft);
  question = press(Key::kEnter);
  EXPECT_EQ(question->moment, then);
  EXPECT_EQ(question->seen,
            (std::vector<std::string>{"  /arm:i: /object:o has won for 3.0 s, since " +
                                      clock_text({}) + ": /object:o began"}));
  EXPECT_THAT(screen(), HasSubstr("Why /arm:i, at " + clock_text(then->wall)));
  view_.set_answer({{question->ports, "", nullptr}, {"of now"}});
  EXPECT_THAT(screen(), Not(HasSubstr("of now")));  // that was another question
  view_.set_answer({*question, {"of then"}});
  EXPECT_THAT(screen(), HasSubstr("of then"));
  press(Key::kEscape);
  // By another model, nobody can say any more why it was so.
  Frame frame = frame_at(13);
  ++frame.generation;
  view_.add(shared(frame), {});
  question = press(Key::kEnter);
  EXPECT_EQ(question->moment, nullptr);
  EXPECT_THAT(screen(), HasSubstr("Why /arm:i, now"));
  EXPECT_THAT(screen(), HasSubstr("the answer is of now: another model is in force"));
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
  EXPECT_THAT(text, testing::EndsWith("began"));
  EXPECT_THAT(text, HasSubstr("…"));
  EXPECT_THAT(screen({200, 30}), HasSubstr(names[2] + " began"));
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
