// Graphviz's program dot, which turns a picture's text into the picture.
#pragma once

#include <chrono>
#include <functional>
#include <string>

namespace arbiter::drawing {

// Whom to tell while dot is at work, which takes minutes for hundreds of behaviours. If tell()
// throws, dot is ended.
struct Waiting {
  std::function<void()> tell = [] {};
  std::chrono::milliseconds period{100};  // of silence
};

struct Layout {
  std::string picture;
  bool is_shrunk = false;  // dot has made it smaller, for it does not make so many dots
};

// `format` as dot knows it: "svg", "png". Throws std::runtime_error: dot is not installed (and how
// to come by it), or could not draw this.
Layout lay_out(const std::string& dot, const std::string& format, const Waiting& waiting = {});

}  // namespace arbiter::drawing
