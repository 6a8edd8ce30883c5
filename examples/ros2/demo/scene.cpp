#include "scene.hpp"

#include <array>
#include <cstdio>

namespace ros2_demo {
namespace {

const std::string navigation = in_words(0.6, 0.35);
const std::string teleop = in_words(0.3, -0.9);
const std::string stands = in_words(0, 0);

}  // namespace

std::string in_words(double forwards, double turning) {
  if (forwards == 0 && turning == 0) return "stands";
  std::array<char, 60> text{};
  std::snprintf(text.data(), text.size(), "drives %.2f m/s, turns %.2f rad/s", forwards, turning);
  return text.data();
}

Commands commands_by_arbiter() {
  return {navigation, teleop, navigation, stands, navigation, stands, navigation};
}

Commands commands_by_mux() { return {navigation, teleop, navigation}; }

}  // namespace ros2_demo
