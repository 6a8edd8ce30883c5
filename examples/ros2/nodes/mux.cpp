// What twist_mux does with the same topics, to compare: the highest priority that is not silent for
// longer than its time-out, unless a lock is held or its heartbeat is lost. Then it publishes
// nothing.
#include <mutex>
#include <optional>

#include "node.hpp"

namespace {

using ros2_demo::Clock;
constexpr auto kTimeout = std::chrono::milliseconds(500);

struct Heard {
  std::optional<Clock::time_point> at;
  [[nodiscard]] bool expired() const { return !at || Clock::now() - *at > kTimeout; }
};

constexpr const char* kMuxHelp =
    "What twist_mux does with rt/cmd_vel_nav, rt/cmd_vel_teleop and the lock rt/e_stop.\n"
    "Usage: mux\n\n"
    "It publishes rt/mux/cmd_vel.";

}  // namespace

int main(int argc, char** argv) {
  if (ros2_demo::printed_help(argc, argv, kMuxHelp)) return 0;
  ros2_demo::Node node;
  std::mutex mutex;
  Heard navigation;  // priority 10
  Heard teleop;      // priority 100
  Heard lock;        // priority 255
  bool locked = false;
  const auto publish = node.publisher<ros2_demo::Twist>("rt/mux/cmd_vel");
  const auto passes = [&] { return !lock.expired() && !locked; };
  std::function<void(const ros2_demo::Twist&)> on_navigation = [&](const ros2_demo::Twist& twist) {
    const std::lock_guard guard(mutex);
    navigation.at = Clock::now();
    if (passes() && teleop.expired()) publish(twist);
  };
  std::function<void(const ros2_demo::Twist&)> on_teleop = [&](const ros2_demo::Twist& twist) {
    const std::lock_guard guard(mutex);
    teleop.at = Clock::now();
    if (passes()) publish(twist);
  };
  std::function<void(const ros2_demo::Bool&)> on_lock = [&](const ros2_demo::Bool& is_locked) {
    const std::lock_guard guard(mutex);
    lock.at = Clock::now();
    locked = is_locked.data;
  };
  node.subscribe("rt/cmd_vel_nav", on_navigation);
  node.subscribe("rt/cmd_vel_teleop", on_teleop);
  node.subscribe("rt/e_stop", on_lock);
  for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}
