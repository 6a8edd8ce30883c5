// An emergency stop with a heartbeat: ten times a second it says whether it is pressed. The first
// interval: it is. The second: it has died, and says nothing.
#include "node.hpp"

namespace {

constexpr const char* kEStopHelp =
    "An emergency stop, which says ten times a second on rt/e_stop whether it is pressed.\n"
    "Usage: e_stop [START [PRESSED [DEAD]]]\n\n"
    "START is a time of the steady clock in nanoseconds. PRESSED and DEAD are when it is\n"
    "pressed, and when it says nothing, in seconds since then: 5-9.";

}  // namespace

int main(int argc, char** argv) {
  if (ros2_demo::printed_help(argc, argv, kEStopHelp)) return 0;
  ros2_demo::Node node;
  const auto publish = node.publisher<ros2_demo::Bool>("rt/e_stop");
  for (ros2_demo::Script script(argc, argv);;) {
    script.wait(std::chrono::milliseconds(100));
    const bool is_pressed = script.is_in(0);
    const bool is_dead = script.is_in(1);
    if (!is_dead) publish(ros2_demo::Bool{is_pressed});
  }
}
