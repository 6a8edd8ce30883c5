// To wait for what another process or thread does.
#pragma once

#include <poll.h>

#include <functional>

namespace arbiter::test {

// Asks until it holds. That it never does shows as the test's time limit.
inline void await(const std::function<bool()>& holds) {
  while (!holds()) ::poll(nullptr, 0, 1);
}

}  // namespace arbiter::test
