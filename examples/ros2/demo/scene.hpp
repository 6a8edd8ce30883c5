// What happens, and what should come of it: at what time who commands, and what is said of it.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace ros2_demo {

// In seconds, of a scene of 20.
struct Interval {
  double from;
  double to;
};
inline constexpr double kSceneSeconds = 20;
inline constexpr Interval kNavigates{0, kSceneSeconds + 10};
inline constexpr Interval kTeleoperates{5, 9};
inline constexpr Interval kPressed{12, 14};
inline constexpr Interval kDead{16, 18};

struct Caption {
  double from;
  std::string_view what;
  std::string_view why;
};
inline constexpr std::array<Caption, 7> kCaptions{{
    {-100, "The nodes are starting.", "None of them knows of Arbiter."},
    {0, "Navigation drives.", "It publishes on /cmd_vel_nav; the emergency stop says: released."},
    {kTeleoperates.from, "Somebody takes the joystick.",
     "Teleoperate inhibits Navigate: its commands lose."},
    {kTeleoperates.to, "The joystick is let go.",
     "Half a second later teleoperation is over, and navigation drives again."},
    {kPressed.from, "The emergency stop is pressed.",
     "Arbiter's base is told to stand. The mux is silent, so its base drives on."},
    {kPressed.to, "It is released.", "Navigation drives."},
    {kDead.from, "The emergency stop's node dies.",
     "Its heartbeat is lost: that, too, stops Arbiter's base, and no other."},
}};

// What a base was told, in its order; what follows each other and is equal, once.
using Commands = std::vector<std::string>;
// Of a base behind Arbiter, and of one behind what twist_mux does.
[[nodiscard]] Commands commands_by_arbiter();
[[nodiscard]] Commands commands_by_mux();

// "drives 0.60 m/s, turns 0.35 rad/s", "stands"
[[nodiscard]] std::string in_words(double forwards, double turning);

}  // namespace ros2_demo
