// Who takes part, where, and when what happens.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "network.hpp"

namespace hosts_demo {

enum class Role { daemon, link, sender, motor };

struct Part {
  std::size_t host;
  std::string_view program;
  Role role;
  std::string_view port;
};

// The camera is in the head; the motors, and what they fall back to, are in the body.
inline constexpr std::array<Part, 11> kParts{{
    {kHead, "arbiterd", Role::daemon, ""},
    {kHead, "arbiter-link", Role::link, ""},
    {kHead, "face-detector", Role::sender, "/Face/pos:o"},
    {kHead, "object-detector", Role::sender, "/Object/pos:o"},
    {kBody, "arbiterd", Role::daemon, ""},
    {kBody, "arbiter-link", Role::link, ""},
    {kBody, "random-look", Role::sender, "/RandomLook/pos:o"},
    {kBody, "rest-arm", Role::sender, "/RestArm/pos:o"},
    {kBody, "collision-detector", Role::sender, "/collision:o"},
    {kBody, "gaze-control", Role::motor, "/Gaze/pos:i"},
    {kBody, "arm-control", Role::motor, "/Arm/pos:i"},
}};
inline constexpr std::size_t kHeadsLink = 1, kGaze = 9, kArm = 10;
inline constexpr std::string_view kObjectPort = "/Object/pos:o";
inline constexpr std::string_view kRestPort = "/RestArm/pos:o";

// In seconds of a scene that lasts for this long.
inline constexpr double kSceneSeconds = 40;
struct Interval {
  double from;
  double to;
};
inline constexpr Interval kFace{3, 5};
inline constexpr Interval kObject{7, 36};
inline constexpr Interval kCable{12, 19};  // it is out
inline constexpr Interval kLink{25, 29};   // the head's link is dead
// So long after the cable was pulled, in real seconds, T has passed, and the motor has said so.
inline constexpr double kAfterT = 1;

// Who commanded a motor from when on; empty: nobody.
struct Reign {
  double since;
  std::string source;
};
using Reigns = std::vector<Reign>;

// Whether the arm did what the page says. `pace`: real seconds in one of the scene.
[[nodiscard]] bool is_as_the_page_says(const Reigns& arm, double pace);

}  // namespace hosts_demo
