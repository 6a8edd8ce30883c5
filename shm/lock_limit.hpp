// How much memory a process may lock, in words for whoever meets that limit.
#pragma once

#include <sys/resource.h>

#include <cstddef>
#include <string>

namespace arbiter::shm {

inline std::string kibibytes(std::size_t bytes) {
  return std::to_string((bytes + 1023) / 1024) + " KiB";
}

// Empty: there is no such limit.
inline std::string lock_limit_text() {
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return {};
  return "a process of this user may lock " + kibibytes(limit.rlim_cur) +
         " (RLIMIT_MEMLOCK) in all; raise it with ulimit -l, with LimitMEMLOCK= in a systemd unit, "
         "or with memlock in /etc/security/limits.conf";
}

}  // namespace arbiter::shm
