// Arm Control: reaches for the place that its input port says, whoever it is that says so.
#include "component.hpp"
#include "motor.hpp"
#include "position.hpp"

using namespace search_and_track;
using namespace std::chrono_literals;

int main() try {
  arbiter::Node node("arm-control");
  auto targets = node.input_port<Position>("/Arm/pos:i", {.depth = 1});

  for (;;) {
    const auto target = targets.wait_for(1s);
    if (target) {
      Motor::move_to(**target, target->source());
    } else if (target.idle()) {
      Motor::stop();  // nobody commands any more: an arm that went on might hit something
    }
    // Else the second has passed without news, and the arm does what it did before.
  }
} catch (const std::exception& error) {
  return fail("arm-control", error);
}
