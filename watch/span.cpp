#include "watch/span.hpp"

#include <algorithm>
#include <cstdio>

namespace arbiter::watch {

std::string span_text(shm::Nanoseconds span) {
  char text[64];
  const auto value = static_cast<double>(std::max<shm::Nanoseconds>(span, 0));
  if (value < 1e5) {
    std::snprintf(text, sizeof text, "%.0f us", value / 1e3);
  } else if (value < 1e6) {
    std::snprintf(text, sizeof text, "%.1f ms", value / 1e6);
  } else if (value < 1e9) {
    std::snprintf(text, sizeof text, "%.0f ms", value / 1e6);
  } else if (value < 1e11) {
    std::snprintf(text, sizeof text, "%.1f s", value / 1e9);
  } else {
    std::snprintf(text, sizeof text, "%.0f s", value / 1e9);
  }
  return text;
}

}  // namespace arbiter::watch
