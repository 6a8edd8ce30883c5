// Spans of time, for people.
#pragma once

#include <string>

#include "shm/activity.hpp"

namespace arbiter::watch {

// 3 200 000 000 -> "3.2 s".
[[nodiscard]] std::string span_text(shm::Nanoseconds span);

}  // namespace arbiter::watch
