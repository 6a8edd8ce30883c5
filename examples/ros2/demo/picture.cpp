#include "picture.hpp"

#include <cmath>
#include <cstdio>
#include <string>

namespace ros2_demo {
namespace {

using search_and_track::Canvas;
using search_and_track::Colour;
using search_and_track::kBold;
using search_and_track::kDim;
using search_and_track::Style;

constexpr int kWidth = 36;
constexpr int kHeight = 14;
constexpr double kMetresAcross = 8;
constexpr double kMetresDown = 6.2;

// The floor has no walls: who leaves it on one side comes back on the other.
int cell(double metres, double whole, int cells) {
  const double part = metres / whole + 0.5;
  return static_cast<int>((part - std::floor(part)) * cells);
}

int row_of(double y) { return cell(-y, kMetresDown, kHeight); }
int column_of(double x) { return cell(x, kMetresAcross, kWidth); }

const char* arrow(double direction) {
  constexpr std::array kArrows = {"→", "↗", "↑", "↖", "←", "↙", "↓", "↘"};
  const long eighth = std::lround(direction / (3.14159265358979 / 4));
  return kArrows.at(static_cast<std::size_t>(((eighth % 8) + 8) % 8));
}

void draw_base(Canvas& canvas, int top, int left, const Base& base) {
  const bool stands = base.now == "stands";
  canvas.put(top, left, base.title, kBold);
  canvas.put(top + 1, left, "┌");
  canvas.repeat(top + 1, left + 1, kWidth, "─");
  canvas.put(top + 1, left + kWidth + 1, "┐");
  for (int row = 0; row < kHeight; ++row) {
    canvas.put(top + 2 + row, left, "│");
    canvas.put(top + 2 + row, left + kWidth + 1, "│");
  }
  canvas.put(top + 2 + kHeight, left, "└");
  canvas.repeat(top + 2 + kHeight, left + 1, kWidth, "─");
  canvas.put(top + 2 + kHeight, left + kWidth + 1, "┘");
  for (const auto& [x, y] : base.trail) {
    canvas.put(top + 2 + row_of(y), left + 1 + column_of(x), "·", kDim);
  }
  if (base.is_known) {
    canvas.put(top + 2 + row_of(base.y), left + 1 + column_of(base.x), arrow(base.direction),
               Style{.colour = stands ? Colour::red : Colour::green, .bold = true, .filled = true});
  }
  canvas.put(top + 3 + kHeight, left + 1, base.now,
             Style{.colour = stands ? Colour::red : Colour::plain, .bold = stands});
}

}  // namespace

void Base::said(std::string_view line) {
  double forwards = 0;
  double turning = 0;
  if (std::sscanf(std::string(line).c_str(), "%lf %lf %lf %lf %lf", &x, &y, &direction, &forwards,
                  &turning) != 5) {
    return;
  }
  is_known = true;
  now = in_words(forwards, turning);
  // Before the first command it stands because nobody has told it anything.
  const bool is_new = commands.empty() ? now != "stands" : now != commands.back();
  if (is_new) commands.push_back(now);
  trail.push_back({x, y});
  if (trail.size() > 200) trail.erase(trail.begin());
}

void draw(Canvas& canvas, const std::array<Base, 2>& bases, double now) {
  const Caption* caption = &kCaptions.front();
  for (const Caption& each : kCaptions) {
    if (now >= each.from) caption = &each;
  }
  std::array<char, 20> time{};
  std::snprintf(time.data(), time.size(), "%.1f s", now < 0 ? 0 : now);
  canvas.put(0, 1, "ROS 2 names, DDS programs, one arbiter", kBold);
  canvas.put(0, 70, time.data(), kDim);
  draw_base(canvas, 2, 0, bases[0]);
  draw_base(canvas, 2, 40, bases[1]);
  canvas.put(21, 1, caption->what, kBold);
  canvas.put(22, 1, caption->why);
}

}  // namespace ros2_demo
