// Gaze Control: turns the head to where its input port says, whoever it is that says so.
#include "component.hpp"
#include "motor.hpp"
#include "position.hpp"

using namespace search_and_track;
using namespace std::chrono_literals;

int main() try {
  arbiter::Node node("gaze-control");
  // Only the latest place matters: where to look now, not where to have looked.
  auto places = node.input_port<Position>("/Gaze/pos:i", {.depth = 1});

  for (;;) {
    const auto place = places.wait_for(1s);
    if (place) {
      Motor::move_to(**place, place->source());
    } else if (place.idle()) {
      Motor::stop();  // nobody commands any more
    }
    // Else the second has passed without news, and the head does what it did before.
  }
} catch (const std::exception& error) {
  return fail("gaze-control", error);
}
