// How far a long run is: on standard error, and only where somebody waits for it.
#include "cli/progress.hpp"

#include <gtest/gtest.h>

#include <sstream>

namespace arbiter::test {
namespace {

using cli::ProgressLine;
using namespace std::chrono_literals;

struct Watched {
  explicit Watched(bool is_terminal) : line(out, is_terminal, [this] { return now; }) {}
  void at(std::chrono::milliseconds time, std::size_t done, const std::string& name = "/p") {
    now = ProgressLine::Clock::time_point(time);
    line.watch()({"proving", done, 9, name});
  }

  ProgressLine::Clock::time_point now;
  std::ostringstream out;
  ProgressLine line;
};

TEST(Progress, ARunThatIsOverSoonSaysNothing) {
  Watched terminal(true), file(false);
  terminal.at(299ms, 3);
  file.at(1999ms, 3);
  terminal.line.clear();
  EXPECT_EQ(terminal.out.str(), "");
  EXPECT_EQ(file.out.str(), "");
}

TEST(Progress, OnATerminalOneLineChangesAndIsGoneAtTheEnd) {
  Watched watched(true);
  watched.at(300ms, 1);
  watched.at(350ms, 2);
  watched.at(400ms, 3, "/q");
  watched.line.clear();
  watched.line.clear();
  EXPECT_EQ(watched.out.str(), "\r\033[Kproving: 1 of 9 (/p)\r\033[Kproving: 3 of 9 (/q)\r\033[K");
}

TEST(Progress, ElsewhereThereIsALineAfterTwoSecondsAndThenOneEveryTen) {
  Watched watched(false);
  watched.at(2000ms, 1);
  watched.at(11'999ms, 2);
  watched.at(12'000ms, 3);
  watched.line.clear();
  EXPECT_EQ(watched.out.str(), "proving: 1 of 9 (/p)\nproving: 3 of 9 (/p)\n");
}

TEST(Progress, OfWhatHasNoStepsSaysForHowLongItTakes) {
  Watched watched(false);
  const auto show = [&](std::chrono::milliseconds time) {
    watched.now = ProgressLine::Clock::time_point(time);
    watched.line.show([&] { return std::to_string(watched.line.elapsed().count()) + " s"; });
  };
  show(1999ms);
  show(2500ms);
  show(12'499ms);
  show(12'500ms);
  EXPECT_EQ(watched.out.str(), "2 s\n12 s\n");
}

TEST(Progress, ALongStatementIsCutBetweenCharacters) {
  Watched watched(false);
  watched.at(2000ms, 1, std::string(47, 'a') + "∧ and more");
  EXPECT_EQ(watched.out.str(), "proving: 1 of 9 (" + std::string(47, 'a') + "…)\n");
}

}  // namespace
}  // namespace arbiter::test
