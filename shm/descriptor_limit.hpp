// How many descriptors this process may have.
#pragma once

#include <sys/resource.h>

#include <algorithm>

namespace arbiter::shm {

// The limit that a shell or a service manager gives is one for programs that wait by select(): this
// process, and those that it starts, may have as many as they are allowed, up to `most`. Where it
// may not be raised, there are fewer.
inline void raise_descriptor_limit(rlim_t most = RLIM_INFINITY) noexcept {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  const rlim_t wanted = std::min(limit.rlim_max, most);
  if (limit.rlim_cur >= wanted) return;
  limit.rlim_cur = wanted;
  static_cast<void>(::setrlimit(RLIMIT_NOFILE, &limit));
}

}  // namespace arbiter::shm
