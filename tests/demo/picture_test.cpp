// What somebody sees who runs the demo in a terminal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/demo/demo.hpp"
#include "tests/demo/terminal_session.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kCaptionRow = 14;

void expect_terminal_as_before(const Screen& screen) {
  EXPECT_FALSE(screen.is_alternate());
  EXPECT_TRUE(screen.has_cursor());
  EXPECT_TRUE(screen.wraps());
}

TEST(Picture, TellsTheStoryInEightyByTwentyFour) {
  const Demo demo;
  TerminalSession session(demo.command({"--seconds", "10"}), 24, 80);
  std::vector<std::string> captions;
  std::string last_picture;
  session.watch_until([&] {
    const std::string caption = session.screen().row(kCaptionRow);
    if (captions.empty() || captions.back() != caption) captions.push_back(caption);
    if (session.screen().is_alternate()) last_picture = session.screen().text();
    return false;
  });
  EXPECT_EQ(session.watch_to_the_end(), 0) << session.written();
  auto next = captions.begin();
  for (const char* const sentence :
       {"Nothing is in sight: Look Around moves the gaze, Rest Arm parks the arm.",
        "A face appeared: Follow Face inhibits Look Around.",
        "An object appeared: Track Object takes gaze and arm.",
        "A collision: Track Object must not run, and both motors stop.",
        "The collision is over: Track Object takes both again.",
        "The object is gone: Follow Face and Rest Arm are free again.",
        "The face is gone: everything has fallen back."}) {
    next = std::find_if(next, captions.end(), [&](const std::string& caption) {
      return caption.find(sentence) != std::string::npos;
    });
    EXPECT_NE(next, captions.end()) << "not shown in its turn: " << sentence << "\n"
                                    << testing::PrintToString(captions);
  }
  EXPECT_THAT(last_picture, HasSubstr("look"));
  EXPECT_THAT(last_picture, HasSubstr("▏stop"));
  EXPECT_THAT(last_picture, HasSubstr("obeys Random Look"));
  EXPECT_FALSE(session.screen().has_overflown());
  EXPECT_TRUE(session.screen().has_had_colour());
  EXPECT_THAT(session.screen().not_understood(), IsEmpty());
  EXPECT_THAT(session.written(), HasSubstr("These are the winners that the paper's model demands"));
  expect_terminal_as_before(session.screen());
}

TEST(Picture, IsCutToASmallerTerminalAndHonoursNoColor) {
  const Demo demo;
  TerminalSession session(demo.command({}, "NO_COLOR=1"), 12, 50);
  ASSERT_TRUE(session.watch_until(
      [&] { return session.screen().text().find("Rest Arm") != std::string::npos; }));
  session.type("\x03");  // Ctrl-C
  EXPECT_EQ(session.watch_to_the_end(), 128 + SIGINT);
  EXPECT_FALSE(session.screen().has_overflown());
  EXPECT_FALSE(session.screen().has_had_colour());
  expect_terminal_as_before(session.screen());
}

TEST(Picture, GivesTheTerminalBackOnCtrlC) {
  const Demo demo;
  TerminalSession session(demo.command({}), 24, 80);
  ASSERT_TRUE(session.watch_until(
      [&] { return session.screen().text().find("obeys Rest Arm") != std::string::npos; }));
  EXPECT_FALSE(session.screen().has_cursor());
  session.type("\x03");
  EXPECT_EQ(session.watch_to_the_end(), 128 + SIGINT);
  expect_terminal_as_before(session.screen());
  EXPECT_THAT(session.written(), HasSubstr("Stopped after"));
  EXPECT_THAT(demo.processes(), IsEmpty());
  EXPECT_THAT(demo.files_left(), IsEmpty());
}

}  // namespace
}  // namespace arbiter::test
