#include "scene.hpp"

#include <array>
#include <cstdio>

namespace ros2_demo {
namespace {

const std::string kNavigation = in_words(0.6, 0.35);
const std::string kTeleop = in_words(0.3, -0.9);
const std::string kStands = in_words(0, 0);

}  // namespace

std::string in_words(double forwards, double turning) {
  if (forwards == 0 && turning == 0) return "stands";
  std::array<char, 60> text{};
  std::snprintf(text.data(), text.size(), "drives %.2f m/s, turns %.2f rad/s", forwards, turning);
  return text.data();
}

Commands commands_by_arbiter() {
  return {kNavigation, kTeleop, kNavigation, kStands, kNavigation, kStands, kNavigation};
}

Commands commands_by_mux() { return {kNavigation, kTeleop, kNavigation}; }

}  // namespace ros2_demo
