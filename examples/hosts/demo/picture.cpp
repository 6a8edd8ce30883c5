#include "picture.hpp"

#include <algorithm>
#include <cstdio>

namespace hosts_demo {
namespace {

using search_and_track::Canvas;
using search_and_track::Colour;
using search_and_track::Style;

constexpr Style kPlain{};
constexpr Style kFaint{.dim = true};
constexpr Style kStrong{.bold = true};
constexpr int kWidth = 35;  // of a host's box
constexpr int kTop = 2;
constexpr int kHeight = 17;
constexpr std::array<int, kHosts> kLeft{0, 44};

void box(Canvas& canvas, int left, const std::string& title) {
  const int right = left + kWidth;
  canvas.put(kTop, left, "╭─ " + title + " ", kStrong);
  const int after = left + 4 + static_cast<int>(title.size());
  canvas.repeat(kTop, after, right - after, "─", kFaint);
  canvas.put(kTop, right, "╮", kFaint);
  for (int row = kTop + 1; row < kTop + kHeight; ++row) {
    canvas.put(row, left, "│", kFaint);
    canvas.put(row, right, "│", kFaint);
  }
  canvas.put(kTop + kHeight, left, "╰", kFaint);
  canvas.repeat(kTop + kHeight, left + 1, kWidth - 1, "─", kFaint);
  canvas.put(kTop + kHeight, right, "╯", kFaint);
}

std::string second_line(const Part& part, const State& state, std::size_t index) {
  if (part.role != Role::motor) return state.parts[index].said;
  const Reigns& reigns = state.reigns[index];
  if (reigns.empty()) return "nobody yet";
  return reigns.back().source.empty() ? "nobody: it stands" : "obeys " + reigns.back().source;
}

void draw_part(Canvas& canvas, int row, std::size_t index, const State& state) {
  const Part& part = kParts[index];
  const PartState& its = state.parts[index];
  const int left = kLeft[part.host] + 2;
  const bool is_dead = its.pid < 0;
  const bool sends = !its.said.empty() && its.said != "silent";
  const char* const light = is_dead ? "✕" : (part.role != Role::sender || sends ? "●" : "○");
  const Style style = is_dead ? Style{.colour = Colour::red, .bold = true} : kStrong;
  canvas.put(row, left, light, style);
  const int after = canvas.put(row, left + 2, part.program, is_dead ? style : kPlain);
  canvas.put(row, after + 1, is_dead ? "dead" : "pid " + std::to_string(its.pid), kFaint);
  std::string line = std::string(part.port);
  const std::string more = second_line(part, state, index);
  if (!more.empty()) line += (line.empty() ? "" : " ") + more;
  if (line.size() > kWidth - 5) line.resize(kWidth - 5);
  const bool commands = part.role == Role::motor && !is_dead;
  canvas.put(row + 1, left + 2, line,
             commands ? Style{.colour = Colour::green, .bold = true} : kFaint);
}

void draw_cable(Canvas& canvas, const State& state) {
  const int from = kLeft[kHead] + kWidth + 1;
  const int row = kTop + 4;
  if (state.is_plugged) {
    canvas.repeat(row, from, kLeft[kBody] - from, "═", {.colour = Colour::cyan, .bold = true});
    return;
  }
  canvas.put(row, from, "═╸  ✕  ╺", {.colour = Colour::red, .bold = true});
  canvas.put(row + 1, from, " pulled", {.colour = Colour::red});
}

}  // namespace

void draw(Canvas& canvas, const State& state, double now, double seconds) {
  std::array<char, 60> time{};
  std::snprintf(time.data(), time.size(), "%.1f s of %.0f", std::max(now, 0.0), seconds);
  canvas.put(0, 1, "Search and Track on two hosts", kStrong);
  canvas.put(0, 32, state.network, kFaint);
  canvas.put(0, 66, time.data(), kFaint);
  for (std::size_t host = 0; host < kHosts; ++host) box(canvas, kLeft[host], kHostNames[host]);
  std::array<int, kHosts> row{kTop + 1, kTop + 1};
  for (std::size_t part = 0; part < kParts.size(); ++part) {
    int& its = row[kParts[part].host];
    draw_part(canvas, its, part, state);
    // The daemon has nothing to say.
    its += kParts[part].role == Role::daemon ? 1 : 2;
  }
  draw_cable(canvas, state);
  canvas.put(kRows - 1, 1, "▌ " + state.caption, kStrong);
}

}  // namespace hosts_demo
