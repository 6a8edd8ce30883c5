// Graphviz's program dot, which turns a picture's text into the picture.
#pragma once

#include <chrono>
#include <functional>
#include <string>

namespace arbiter::drawing {

// Whom to tell while dot is at work, which takes minutes for hundreds of behaviours.
struct Waiting {
  std::function<void()> tell = [] {};
  std::chrono::milliseconds first{2'000}, then{10'000};  // of silence
};

// `format` as dot knows it: "svg", "png". Throws std::runtime_error: dot is not installed (and how
// to come by it), or could not draw this.
std::string lay_out(const std::string& dot, const std::string& format, const Waiting& waiting = {});

}  // namespace arbiter::drawing
