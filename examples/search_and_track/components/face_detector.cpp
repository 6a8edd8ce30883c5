// Face Detector: sends where the face is, as long as there is one.
#include <cmath>

#include "component.hpp"
#include "position.hpp"

using namespace search_and_track;

int main(int argc, char** argv) try {
  const World world(argc, argv);
  arbiter::Node node("face-detector");
  auto faces = node.output_port<Position>("/Face/pos:o");

  Report report;
  for (;; World::wait()) {
    if (world.has_something()) {
      const double sway = std::sin(0.9 * world.seconds());  // people do not stand still
      report.sent(faces.publish({1.2, 0.35 * sway, 0.5}));
    } else {
      report.silent();
    }
  }
} catch (const std::exception& error) {
  return fail("face-detector", error);
}
