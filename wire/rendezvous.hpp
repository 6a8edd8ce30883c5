// Where a daemon and its clients meet: a socket in a runtime directory, one for each instance.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "shm/file_descriptor.hpp"

namespace arbiter::wire {

inline constexpr const char* kDefaultInstance = "default";

// `given`, else $ARBITER_INSTANCE, else "default". Throws std::invalid_argument unless it is 1 to
// 64 letters, digits, '_', '-' or '.', not beginning with '.'.
std::string instance_name(const std::string& given);

// The daemon's directory, made if need be: $RUNTIME_DIRECTORY (the first of several), else
// $XDG_RUNTIME_DIR/arbiter if that exists, else /run/arbiter if we may write there, else
// arbiter-UID in $TMPDIR or /tmp. Throws std::runtime_error where it is not ours, or others may
// write in it.
std::string daemon_directory();

// The directories in which a client looks, in this order.
std::vector<std::string> client_directories();

// Whether the directory is there and belongs to somebody whose daemon is not trusted: what lies in
// it is not even looked at.
bool is_a_strangers(const std::string& directory);

// A listening socket at DIRECTORY/INSTANCE.sock that every user may connect to. Holds a lock beside
// it for as long as the result lives; throws std::runtime_error if another daemon has it.
struct Listener {
  shm::FileDescriptor lock;
  shm::FileDescriptor socket;
  std::string path;
};
Listener listen_at(const std::string& directory, const std::string& instance);

// The same for the instance's link, at DIRECTORY/INSTANCE.link: in daemon_directory(), which for
// the service is /run/arbiter-link.
Listener listen_as_link(const std::string& directory, const std::string& instance);

// Connects to the instance's daemon, if one listens in any of the directories. One is trusted that
// runs as root, as the user `arbiter`, as this user, or, in /run/arbiter, as the user to whom root
// has given that directory. Where there is none, `why_not` lists the sockets that were tried, each
// with what was wrong.
// `directory`, where it is given: the one in which it was found. `mode`: SOCK_NONBLOCK for a socket
// that does not block, not even here where too many wait to be let in; else that takes a second.
std::optional<shm::FileDescriptor> connect_to_daemon(const std::string& instance,
                                                     std::string& why_not,
                                                     std::string* directory = nullptr,
                                                     int mode = 0);

// Likewise to the instance's link, which is trusted as a daemon is; in /run/arbiter-link, as the
// user to whom root has given that.
std::optional<shm::FileDescriptor> connect_to_link(const std::string& instance,
                                                   std::string& why_not);

// The sockets of trusted daemons of the instance that listen elsewhere than in `directory`: whose
// environment is another meets them, and shares nothing with who meets here. Not looked for in
// directories of others than root, this user, and the owner of /run/arbiter.
std::vector<std::string> other_daemons(const std::string& instance, const std::string& directory);

}  // namespace arbiter::wire
