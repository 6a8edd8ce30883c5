// Follows a path: a wide curve to the left.
#include "node.hpp"

int main(int argc, char** argv) {
  ros2_demo::Node node;
  const auto publish = node.publisher<ros2_demo::Twist>("rt/cmd_vel_nav");
  for (ros2_demo::Script script(argc, argv);;) {
    script.wait(std::chrono::milliseconds(50));
    if (script.is_in(0)) publish(ros2_demo::twist(0.6, 0.35));
  }
}
