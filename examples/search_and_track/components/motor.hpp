// Stands in for a motor: says what it does, one line for each order.
#pragma once

#include <iomanip>
#include <iostream>
#include <string>

#include "position.hpp"

namespace search_and_track {

class Motor {
 public:
  static void move_to(const Position& target, const std::string& commander) {
    std::cout << commander << std::fixed << std::setprecision(2) << ' ' << target.x << ' '
              << target.y << ' ' << target.z << std::endl;
  }
  static void stop() { std::cout << "idle" << std::endl; }
};

}  // namespace search_and_track
