// Graphviz's program dot, which turns a picture's text into the picture.
#pragma once

#include <string>

namespace arbiter::drawing {

// `format` as dot knows it: "svg", "png". Throws std::runtime_error: dot is not installed (and how
// to come by it), or could not draw this.
std::string lay_out(const std::string& dot, const std::string& format);

}  // namespace arbiter::drawing
