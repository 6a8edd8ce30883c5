// The view without a terminal: pictures and keys go in, lines come out.
#pragma once

#include <gtest/gtest.h>

#include <clocale>
#include <iterator>
#include <optional>
#include <set>
#include <sstream>
#include <string>

#include "tests/top/pictures.hpp"
#include "top/view.hpp"

namespace arbiter::top {

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

inline std::set<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), std::istream_iterator<std::string>()};
}

}  // namespace arbiter::top
