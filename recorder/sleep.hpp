// Sleeping until a time, or until somebody has something to say.
#pragma once

#include <poll.h>

#include <algorithm>
#include <initializer_list>
#include <vector>

#include "shm/clock.hpp"

namespace arbiter::recorder {

// By CLOCK_MONOTONIC. True: one of the descriptors is readable.
inline bool sleep_until(shm::Nanoseconds time, std::initializer_list<int> descriptors) {
  std::vector<pollfd> ready;
  for (const int descriptor : descriptors) ready.push_back({descriptor, POLLIN, 0});
  for (;;) {
    const shm::Nanoseconds left = std::max<shm::Nanoseconds>(time - shm::monotonic_now(), 0);
    const timespec span{left / 1'000'000'000, left % 1'000'000'000};
    if (ppoll(ready.data(), ready.size(), &span, nullptr) > 0) return true;
    if (left == 0) return false;
  }
}

}  // namespace arbiter::recorder
