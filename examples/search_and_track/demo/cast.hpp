// Who takes part: the components of Search and Track, as the paper's figure 2 has them.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "canvas.hpp"

namespace search_and_track {

// A component that sends.
struct Sender {
  std::string_view name;
  std::string_view program;
  std::string_view port;
  std::string_view mark;  // in the timeline
  Colour colour;
};

inline constexpr std::array<Sender, 5> kSenders{{
    {"Random Look", "random-look", "/RandomLook/pos:o", "look", Colour::cyan},
    {"Face Detector", "face-detector", "/Face/pos:o", "face", Colour::yellow},
    {"Object Detector", "object-detector", "/Object/pos:o", "object", Colour::green},
    {"Rest Arm", "rest-arm", "/RestArm/pos:o", "rest", Colour::magenta},
    {"Collision Detector", "collision-detector", "/collision:o", "collision", Colour::red},
}};
inline constexpr std::size_t kRandomLook = 0, kFace = 1, kObject = 2, kRestArm = 3, kCollision = 4;

// One that receives, at an input port with an arbiter.
struct Receiver {
  std::string_view name;
  std::string_view program;
  std::string_view port;
};

inline constexpr std::array<Receiver, 2> kReceivers{{
    {"Gaze Control", "gaze-control", "/Gaze/pos:i"},
    {"Arm Control", "arm-control", "/Arm/pos:i"},
}};
inline constexpr std::size_t kGaze = 0, kArm = 1;

// Who commands an input port: the index of a sender, or one of these.
using Winner = std::size_t;
inline constexpr Winner kNobody = 100;       // it is idle: its component has been told to stop
inline constexpr Winner kNotYetKnown = 101;  // nothing has come yet
inline constexpr std::string_view kIdle = "idle";

}  // namespace search_and_track
