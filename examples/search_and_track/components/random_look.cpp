// Random Look: somewhere else to look at every second and a half.
#include <random>

#include "component.hpp"
#include "position.hpp"

using namespace search_and_track;

int main(int argc, char** argv) try {
  const World world(argc, argv);
  arbiter::Node node("random-look");
  auto places = node.output_port<Position>("/RandomLook/pos:o");

  std::minstd_rand random(7);
  std::uniform_real_distribution<double> aside(-0.5, 0.5);
  Position place{1, aside(random), 0.4};
  double next_place = 1.5;
  Report report;
  for (;; World::wait()) {
    if (world.seconds() >= next_place) {
      place.y = aside(random);
      next_place += 1.5;
    }
    if (world.has_something()) {
      report.sent(places.publish(place));
    } else {
      report.silent();
    }
  }
} catch (const std::exception& error) {
  return fail("random-look", error);
}
