// Two hosts side by side, and the cable between them.
#pragma once

#include <sys/types.h>

#include <array>
#include <string>

#include "canvas.hpp"
#include "cast.hpp"

namespace hosts_demo {

struct PartState {
  pid_t pid = -1;  // -1: it is dead
  std::string said;
};

struct State {
  std::array<PartState, kParts.size()> parts;
  std::array<Reigns, kParts.size()> reigns;  // of the motors
  bool is_plugged = true;
  std::string network;  // what the cable is
  std::string caption;
};

inline constexpr int kRows = 21;
inline constexpr int kColumns = 80;

void draw(search_and_track::Canvas& canvas, const State& state, double now, double seconds);

}  // namespace hosts_demo
