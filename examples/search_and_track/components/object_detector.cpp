// Object Detector: sends where the object is, as long as it is in view. One output port; how many
// input ports it reaches is not its business.
#include <cmath>

#include "component.hpp"
#include "position.hpp"

using namespace search_and_track;

int main(int argc, char** argv) try {
  const World world(argc, argv);
  arbiter::Node node("object-detector");
  auto objects = node.output_port<Position>("/Object/pos:o");

  Report report;
  for (;; World::wait()) {
    if (world.has_something()) {
      const double t = world.seconds();  // it is being waved about
      report.sent(objects.publish(
          {0.33 + 0.06 * std::cos(2 * t), 0.3 * std::sin(1.7 * t), 0.1 * std::sin(t)}));
    } else {
      report.silent();
    }
  }
} catch (const std::exception& error) {
  return fail("object-detector", error);
}
