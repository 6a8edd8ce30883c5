#pragma once

#include <poll.h>

namespace arbiter::test {

// Now, without waiting.
inline bool is_readable(int fd) {
  pollfd polled{fd, POLLIN, 0};
  return ::poll(&polled, 1, 0) == 1;
}

}  // namespace arbiter::test
