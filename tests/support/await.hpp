// To wait for what another process or thread does.
#pragma once

#include <poll.h>

#include <functional>

namespace arbiter::test {

// Asks until it holds, with pauses of so many milliseconds: the processor is for what it waits for.
// That it never holds shows as the test's time limit.
inline void await(const std::function<bool()>& holds, int pause = 1) {
  while (!holds()) ::poll(nullptr, 0, pause);
}

}  // namespace arbiter::test
