// Two bases seen from above, each with its trail.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "canvas.hpp"
#include "scene.hpp"

namespace ros2_demo {

struct Base {
  std::string_view title{};
  bool is_known = false;
  double x = 0;
  double y = 0;
  double direction = 0;
  std::string now = "is not there yet";
  Commands commands{};
  std::vector<std::array<double, 2>> trail{};

  // A line that a base has printed.
  void said(std::string_view line);
};

// Takes 23 rows and 78 columns.
void draw(search_and_track::Canvas& canvas, const std::array<Base, 2>& bases, double now);

}  // namespace ros2_demo
