// Names in the columns of a terminal.
#include "top/text.hpp"

#include <gtest/gtest.h>

#include <clocale>

#include "top/overlay.hpp"

namespace arbiter::top {
namespace {

class TopText : public testing::Test {
 protected:
  // Widths are the locale's.
  void SetUp() override { ASSERT_NE(std::setlocale(LC_CTYPE, "C.UTF-8"), nullptr); }
};

TEST_F(TopText, PadsAndCutsByColumns) {
  EXPECT_EQ(fit("/Arm", 6, Align::kLeft, Charset::kUtf8), "/Arm  ");
  EXPECT_EQ(fit("3.2", 6, Align::kRight, Charset::kUtf8), "   3.2");
  EXPECT_EQ(fit("/Gaze/pos:i", 6, Align::kLeft, Charset::kUtf8), "/Gaze…");
  EXPECT_EQ(fit("/Gaze/pos:i", 6, Align::kLeft, Charset::kAscii), "/Gaze~");
  EXPECT_EQ(fit("/Gaze", 1, Align::kLeft, Charset::kUtf8), "…");
  EXPECT_EQ(fit("/Gaze", 0, Align::kLeft, Charset::kUtf8), "");
}

TEST_F(TopText, TakesTwoColumnsForAWideCharacter) {
  EXPECT_EQ(columns_of("腕"), 2u);
  EXPECT_EQ(fit("/腕腕腕", 5, Align::kLeft, Charset::kUtf8), "/腕… ");  // half of one cannot be
  EXPECT_EQ(fit("/腕", 5, Align::kLeft, Charset::kUtf8), "/腕  ");
}

TEST_F(TopText, EscapesWhatATerminalWouldObeyOrHide) {
  EXPECT_EQ(safe("a\x1b[2Jb", Charset::kUtf8), "a\\x1b[2Jb");
  EXPECT_EQ(safe("a\nb\t\x7f", Charset::kUtf8), "a\\x0ab\\x09\\x7f");
  EXPECT_EQ(safe("a\xc2\x9b"
                 "31m",
                 Charset::kUtf8),
            "a\\xc2\\x9b31m");  // C1's CSI
  EXPECT_EQ(safe("a\xe2\x80\xae"
                 "b",
                 Charset::kUtf8),
            "a\\xe2\\x80\\xaeb");                               // right to left
  EXPECT_EQ(safe("a\xcc\x81", Charset::kUtf8), "a\\xcc\\x81");  // a character of no width
  EXPECT_EQ(safe("a\xff", Charset::kUtf8), "a\\xff");
}

TEST_F(TopText, EscapesAllButAsciiWhereTheTerminalShowsNoMore) {
  EXPECT_EQ(safe("/腕", Charset::kAscii), "/\\xe8\\x85\\x95");
}

TEST_F(TopText, TellsSpansInSixColumns) {
  EXPECT_EQ(span(0), "0 ms");
  EXPECT_EQ(span(40'000'000), "40 ms");
  EXPECT_EQ(span(3'200'000'000), "3.2 s");
  EXPECT_EQ(span(130'000'000'000), "130 s");
  EXPECT_EQ(span(20 * 60'000'000'000), "20 min");
  EXPECT_EQ(span(48 * 3600'000'000'000), "48 h");
  EXPECT_EQ(span(-5), "0 ms");
  for (shm::Nanoseconds time = 1; time < INT64_MAX / 3; time *= 3) {
    EXPECT_LE(columns_of(span(time)), 7u) << time;
  }
}

TEST_F(TopText, TellsRatesInFiveColumns) {
  EXPECT_EQ(rate(0), "0");
  EXPECT_EQ(rate(0.01), "<0.1");  // not none
  EXPECT_EQ(rate(0.05), "0.1");
  EXPECT_EQ(rate(0.31), "0.3");
  EXPECT_EQ(rate(30), "30.0");
  EXPECT_EQ(rate(1'234), "1234");
  EXPECT_EQ(rate(123'456), "123k");
  EXPECT_EQ(rate(2e6), "2M");
}

TEST_F(TopText, DrawsABarThatFades) {
  EXPECT_EQ(bar(1, 4, Charset::kUtf8), "████");
  EXPECT_EQ(bar(0.5, 4, Charset::kUtf8), "██  ");
  EXPECT_EQ(bar(0.4, 4, Charset::kUtf8), "█▋  ");
  EXPECT_EQ(bar(0.001, 4, Charset::kUtf8), "▏   ");
  EXPECT_EQ(bar(0, 4, Charset::kUtf8), "    ");
  EXPECT_EQ(bar(0.5, 4, Charset::kAscii), "##  ");
  EXPECT_EQ(bar(7, 4, Charset::kAscii), "####");
}

TEST_F(TopText, BreaksLinesAtBlanks) {
  using Lines = std::vector<std::string>;
  EXPECT_EQ(broken("short", 10, Charset::kUtf8), Lines{"short"});
  EXPECT_EQ(broken("  one two three", 10, Charset::kUtf8), (Lines{"  one two", "    three"}));
  EXPECT_EQ(broken("abcdefghijkl", 8, Charset::kUtf8), (Lines{"abcdefgh", "  ijkl"}));
  EXPECT_EQ(broken("", 8, Charset::kUtf8), Lines{""});
  EXPECT_EQ(broken("s r   sort by it", 13, Charset::kUtf8), (Lines{"s r   sort by", "      it"}));
  EXPECT_EQ(broken("s r   abcdefghi", 13, Charset::kUtf8), (Lines{"s r   abcdefg", "      hi"}));
  EXPECT_EQ(broken("s r   sort by it", 9, Charset::kUtf8), (Lines{"s r  ", "  sort by", "  it"}));
  for (std::size_t columns = 1; columns < 20; ++columns) {
    for (const auto* text : {"  some words and a-very-long-one", "term   what it means here"}) {
      for (const auto& line : broken(text, columns, Charset::kUtf8)) {
        EXPECT_LE(columns_of(line), columns);
      }
    }
  }
}

TEST_F(TopText, AnOverlayFollowsTheScreen) {
  const std::vector<std::string> text = {"one two three four", "abcdefghijklmnopqrstuvwxyz"};
  const auto drawn = [](Overlay& overlay, std::size_t width, Charset charset) {
    std::string all;
    for (const Line& each : overlay.draw(width, 20, charset)) all += each.text() + "\n";
    return all;
  };
  Overlay overlay("title", text);
  for (const Charset charset : {Charset::kUtf8, Charset::kAscii}) {
    for (const std::size_t width : {30u, 10u, 10u, 20u}) {
      Overlay anew("title", text);
      EXPECT_EQ(drawn(overlay, width, charset), drawn(anew, width, charset));
    }
  }
  EXPECT_NE(drawn(overlay, 30, Charset::kUtf8), drawn(overlay, 10, Charset::kUtf8));
}

}  // namespace
}  // namespace arbiter::top
