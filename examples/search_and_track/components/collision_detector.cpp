// Collision Detector: says that there is a collision, and nothing else. That it is active is all
// that anybody needs to know, so it sends no samples but signals.
#include "component.hpp"

using namespace search_and_track;

int main(int argc, char** argv) try {
  const World world(argc, argv);
  arbiter::Node node("collision-detector");
  auto collision = node.output_port("/collision:o", {.max_size = 0});

  Report report;
  for (;; World::wait()) {
    if (world.has_something()) {
      report.sent(collision.signal());
    } else {
      report.silent();
    }
  }
} catch (const std::exception& error) {
  return fail("collision-detector", error);
}
