// Rest Arm: keeps sending where the arm is to be parked.
#include "component.hpp"
#include "position.hpp"

using namespace search_and_track;

int main(int argc, char** argv) try {
  const World world(argc, argv);
  arbiter::Node node("rest-arm");
  auto rest = node.output_port<Position>("/RestArm/pos:o");

  Report report;
  for (;; World::wait()) {
    if (world.has_something()) {
      report.sent(rest.publish({0.08, -0.25, -0.1}));
    } else {
      report.silent();
    }
  }
} catch (const std::exception& error) {
  return fail("rest-arm", error);
}
