#include "timeline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace search_and_track {
namespace {

constexpr int kFirst = 12;  // the first column of time
constexpr int kLast = 78;

// Maps seconds to columns.
struct Scale {
  double seconds;
  [[nodiscard]] int column(double time) const {
    const double part = std::clamp(time / seconds, 0.0, 1.0);
    return kFirst + static_cast<int>(std::lround(part * (kLast + 1 - kFirst)));
  }
};

Style block_style(Winner winner) {
  const Colour colour = winner == kNobody ? Colour::red : kSenders[winner].colour;
  return {.colour = colour, .filled = true};
}

std::string_view mark_of(Winner winner) {
  return winner == kNobody ? "stop" : kSenders[winner].mark;
}

// A thin line while the thing was there.
void draw_presence(Canvas& canvas, int row, std::size_t sender, const Scale& scale,
                   const Story& story, double now) {
  canvas.put(row, 1, kSenders[sender].mark, kDim);
  canvas.repeat(row, kFirst, scale.column(now) - kFirst, "╌", kDim);
  for (const auto& span : story.sender(sender).spans) {
    const int from = scale.column(span.from);
    canvas.repeat(row, from, scale.column(std::min(span.to, now)) - from, "━",
                  {.colour = kSenders[sender].colour, .bold = true});
  }
}

// A block for each winner, with its name in it.
void draw_reigns(Canvas& canvas, int row, std::size_t receiver, const Scale& scale,
                 const Story& story, double now) {
  canvas.put(row, 1, receiver == kGaze ? "gaze" : "arm", kBold);
  const auto& reigns = story.receiver(receiver).reigns;
  for (std::size_t i = 0; i < reigns.size(); ++i) {
    const int from = scale.column(reigns[i].since);
    const int to = scale.column(i + 1 < reigns.size() ? reigns[i + 1].since : now);
    const Style style = block_style(reigns[i].winner);
    canvas.repeat(row, from, to - from, " ", style);
    const std::string_view mark = mark_of(reigns[i].winner);
    if (static_cast<int>(mark.size()) < to - from) canvas.put(row, from + 1, mark, style);
    if (i != 0 && to > from) canvas.put(row, from, "▏", style);
  }
}

void draw_axis(Canvas& canvas, int row, const Scale& scale) {
  const int step = scale.seconds >= 12 ? 5 : 2;
  for (int time = 0; time <= static_cast<int>(scale.seconds); time += step) {
    const std::string text = std::to_string(time) + (time == 0 ? " s" : "");
    const int column = std::min(scale.column(time), kLast + 1 - static_cast<int>(text.size()));
    canvas.put(row, column, text, kDim);
  }
}

void draw_legend(Canvas& canvas, int row) {
  int column = 1;
  const auto explain = [&](Winner winner, std::string_view meaning) {
    canvas.put(row, column, "■", {.colour = block_style(winner).colour});
    column = canvas.put(row, column + 2, meaning, kDim) + 2;
  };
  for (const std::size_t sender : {kRandomLook, kFace, kObject, kRestArm}) {
    explain(sender, kSenders[sender].name);
  }
  explain(kNobody, "nobody: stop");
}

}  // namespace

void draw_timeline(Canvas& canvas, int row, const Story& story, double now, double seconds) {
  const Scale scale{seconds};
  draw_presence(canvas, row, kFace, scale, story, now);
  draw_presence(canvas, row + 1, kObject, scale, story, now);
  draw_presence(canvas, row + 2, kCollision, scale, story, now);
  draw_reigns(canvas, row + 3, kGaze, scale, story, now);
  draw_reigns(canvas, row + 4, kArm, scale, story, now);
  draw_axis(canvas, row + 5, scale);
  draw_legend(canvas, row + 6);
}

}  // namespace search_and_track
