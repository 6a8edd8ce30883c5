#include "scene.hpp"

namespace search_and_track {

Scene scene_of(double seconds) {
  const double scale = seconds / kUsualSeconds;
  const auto scaled = [&](double from, double to) { return Interval{from * scale, to * scale}; };
  return {seconds, scaled(4, 17), scaled(7, 14.5), scaled(10, 12)};
}

const std::array<std::vector<Winner>, 2>& winners_of_the_paper() {
  static const std::array<std::vector<Winner>, 2> winners{{
      {kRandomLook, kFace, kObject, kNobody, kObject, kFace, kRandomLook},
      {kRestArm, kObject, kNobody, kObject, kRestArm},
  }};
  return winners;
}

}  // namespace search_and_track
