// An emergency stop with a heartbeat: ten times a second it says whether it is pressed. The first
// interval: it is. The second: it has died, and says nothing.
#include "node.hpp"

int main(int argc, char** argv) {
  ros2_demo::Node node;
  const auto publish = node.publisher<ros2_demo::Bool>("rt/e_stop");
  for (ros2_demo::Script script(argc, argv);;) {
    script.wait(std::chrono::milliseconds(100));
    const bool is_pressed = script.is_in(0);
    const bool is_dead = script.is_in(1);
    if (!is_dead) publish(ros2_demo::Bool{is_pressed});
  }
}
