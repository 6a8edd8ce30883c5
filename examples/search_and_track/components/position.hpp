// What the components send each other.
#pragma once

namespace search_and_track {

// A place in the robot's root frame, in metres: x ahead, y to the left, z up.
struct Position {
  double x = 0;
  double y = 0;
  double z = 0;
};

}  // namespace search_and_track
