// A simulated base. It drives by the last command that it has got, for ever: it has no time-out of
// its own, so that one sees who tells it to stop. Prints where it is: x, y, direction, and the
// command.
#include <cmath>
#include <mutex>

#include "node.hpp"

namespace {

constexpr const char* kBaseHelp =
    "A simulated base, which drives by the last command for ever.\n"
    "Usage: base [TOPIC]\n\n"
    "TOPIC is that of the commands, as DDS calls it; by default rt/cmd_vel.\n"
    "It prints 20 times a second: x, y, direction, speed, rate of turning.";

}  // namespace

int main(int argc, char** argv) {
  if (ros2_demo::printed_help(argc, argv, kBaseHelp)) return 0;
  ros2_demo::Node node;
  std::mutex mutex;
  ros2_demo::Twist command{};
  std::function<void(const ros2_demo::Twist&)> obey = [&](const ros2_demo::Twist& next) {
    const std::lock_guard lock(mutex);
    command = next;
  };
  node.subscribe(argc > 1 ? argv[1] : "rt/cmd_vel", obey);
  constexpr double kStep = 0.05;  // seconds
  double x = 0;
  double y = 0;
  double direction = 0;
  for (auto next = ros2_demo::Clock::now();;) {
    next += std::chrono::milliseconds(50);
    std::this_thread::sleep_until(next);
    const std::lock_guard lock(mutex);
    direction += command.angular.z * kStep;
    x += std::cos(direction) * command.linear.x * kStep;
    y += std::sin(direction) * command.linear.x * kStep;
    std::printf("%.3f %.3f %.3f %.2f %.2f\n", x, y, direction, command.linear.x, command.angular.z);
    std::fflush(stdout);
  }
}
