// Follows a path: a wide curve to the left.
#include "node.hpp"

namespace {

constexpr const char* kNavigationHelp =
    "Navigation, which follows a wide curve to the left: it publishes rt/cmd_vel_nav.\n"
    "Usage: navigation START DRIVES\n\n"
    "START is a time of the steady clock in nanoseconds; DRIVES is when it publishes, in\n"
    "seconds since then: 5-9. Without DRIVES it publishes nothing.";

}  // namespace

int main(int argc, char** argv) {
  if (ros2_demo::printed_help(argc, argv, kNavigationHelp)) return 0;
  ros2_demo::Node node;
  const auto publish = node.publisher<ros2_demo::Twist>("rt/cmd_vel_nav");
  for (ros2_demo::Script script(argc, argv);;) {
    script.wait(std::chrono::milliseconds(50));
    if (script.is_in(0)) publish(ros2_demo::twist(0.6, 0.35));
  }
}
