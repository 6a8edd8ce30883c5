// A listening socket on an address that somebody has typed.
#pragma once

#include <string>

#include "shm/file_descriptor.hpp"

namespace arbiter::cli {

struct Listening {
  shm::FileDescriptor socket;  // does not block
  std::string url;             // "http://127.0.0.1:9180", "unix:/run/x"
  std::string path;            // of a Unix socket: to be unlinked
};

// `address`: ADDRESS:PORT, with IPv6 in brackets, or localhost:PORT; or a path, which contains a
// '/' or ends in ".sock". Asks no name server. Throws Error, which says what is wrong: an address
// that other machines can reach, unless `allow_remote`; one that is taken. A socket that a program
// has left behind is replaced.
Listening listen_on(const std::string& address, bool allow_remote);

}  // namespace arbiter::cli
