// What keys do, and what says so.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/text_files.hpp"
#include "tests/top/view_fixture.hpp"

namespace arbiter::top {
namespace {

using testing::HasSubstr;
using testing::Not;

class TopKeys : public TopView {};

std::set<std::string> helped_keys() {
  std::set<std::string> keys;
  for (const std::string& line : key_lines()) keys.merge(words_of(line.substr(0, line.find("  "))));
  return keys;
}

TEST_F(TopKeys, TheHelpNamesEachKeyThatDoesSomething) {
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

TEST_F(TopKeys, ThePageNamesTheKeysThatTheHelpNames) {
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
TEST_F(TopKeys, TheHelpStandsInTwoColumnsHoweverWideTheScreen) {
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

TEST_F(TopKeys, SaysWhyAKeyDoesNothing) {
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
  press("t");
  Frame alone = frame_at(11);
  alone.has_daemon = false;
  view_.add(shared(alone), {});
  press(" ");
  press("t");
  EXPECT_THAT(screen(), HasSubstr("tapped while a daemon runs, and none does now"));
  EXPECT_TRUE(view_.tapped().empty());
  view_.add(shared(frame_at(12)), {});
  press(" ");
  // What is new is more important.
  view_.set_problem("arbiterd does not let you observe");
  press(" ");
  EXPECT_THAT(screen(), HasSubstr("does not let you observe"));
}

TEST_F(TopKeys, WhySpeaksOfTheMomentShown) {
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
                                      clock_text({}) + ": /object:o became active"}));
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

TEST_F(TopKeys, AsksWhyOfWhatTheCursorIsOn) {
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

TEST_F(TopKeys, TapsThePortOfTheCursorUntilItIsAskedAgain) {
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

TEST_F(TopKeys, ALongExplanationScrolls) {
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

}  // namespace
}  // namespace arbiter::top
