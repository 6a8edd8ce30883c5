// Who asks: the user at the other end of a socket, and what to call one.
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>

#include "service/policy/policy.hpp"

namespace arbiter::service {

// Who is at the other end of a Unix socket: the user and the groups of the process that connected,
// at that moment, which the kernel keeps with the socket. Nothing that a client says enters.
// Throws std::system_error.
Identity peer_identity(int socket);
// Of a user whose groups are such a text: numbers between single blanks. Throws std::runtime_error.
Identity identity_of(uid_t user, std::string_view groups);

// "nobody"; the number where it has no name.
std::string name_of_user(uid_t user);
// "nobody (65534)"; the number alone where it has no name.
std::string describe_user(uid_t user);

}  // namespace arbiter::service
