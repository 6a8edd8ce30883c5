// What happens in front of the robot, and what ought to come of it.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "cast.hpp"

namespace search_and_track {

// In seconds from the start.
struct Interval {
  double from = 0;
  double to = 0;
};

inline constexpr double kUsualSeconds = 20;
// Shorter, the phases would come too near to the half second for which activity lasts.
inline constexpr double kLeastSeconds = 8;

struct Scene {
  double seconds = kUsualSeconds;
  Interval face;
  Interval object;
  Interval collision;
};

// Twenty seconds, or the same faster or slower.
[[nodiscard]] Scene scene_of(double seconds);

// The winners at each input port, in their order, as the paper's model has them in this scene.
[[nodiscard]] const std::array<std::vector<Winner>, 2>& winners_of_the_paper();

}  // namespace search_and_track
